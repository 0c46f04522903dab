//! A cell's service in a process of its own, on a bus in that process, on which the simulated arm
//! moves all the time.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use didim::analysis::identify::LastIdentification;
use didim::archive::events::EventSource;
use didim::cell::Cell;
use didim::live::stream::Pace;
use didim::live::worker;
use didim::service::paths::Paths;
use didim::service::pipeline::{archiver_options, build_acquisition, build_estimation};
use didim::service::reload::reload_of;
use didim::service::status::{
    ClientError, Request, Snapshot, SocketKind, fetch_status, send_request,
};
use didim::service::supervision::{
    Parts, ServiceEnd, ServiceOptions, SocketOptions, run_with_reload,
};
use didim_drivers::source::{InterfaceName, WhenFull, in_process_bus};
use didim_sim::{InProcessSink, VirtualDevice, play};

use super::{Installation, changed};
use crate::common::manager::Manager;
use crate::common::{Network, Process, eventually};

/// The cell of the folder, or a part of it, as `didim run` runs it but for its bus.
#[test]
#[ignore = "the other process of a test"]
fn child_runs_a_cell() {
    let Some(Network { prefix, .. }) = Network::inherited() else { return };
    let file = PathBuf::from(std::env::var_os("DIDIM_TEST_CELL").unwrap());
    let part = std::env::var("DIDIM_TEST_PART").unwrap();
    let folder = file.parent().unwrap();
    let cell = Cell::read(&file).unwrap();
    let paths = Paths { runtime: folder.join("run"), state: Some(folder.join("state")), prefix };
    paths.create_folders().unwrap();
    fn bus(cell: &Cell, paths: &Paths) -> Box<didim::service::supervision::AcquisitionPart> {
        let mut scenario = didim_sim::tx40_paper().unwrap();
        let mut playback = scenario.playback();
        playback.cycles = None;
        scenario = scenario.with_playback(playback).unwrap();
        let name = InterfaceName::new("sim").unwrap();
        let (sender, source) = in_process_bus(&[name], 65_536, WhenFull::Wait);
        let (layout, scales) =
            (cell.bus().unwrap().layout.clone(), cell.bus().unwrap().scales.clone());
        let mut device = VirtualDevice::new(&scenario, layout, scales, 0).unwrap();
        std::thread::spawn(move || {
            let mut sink = InProcessSink::new(sender);
            let pace = didim_sim::Pace::RealTime;
            let _ = play(&mut device, &mut sink, pace, &AtomicBool::new(false));
        });
        build_acquisition(cell, paths, Box::new(source), Pace::Live).unwrap()
    }
    fn work(cell: &Cell, paths: &Paths) -> didim::service::supervision::EstimationPart {
        let mut work = build_estimation(cell, paths, &LastIdentification::default()).unwrap();
        work.options.archiver = archiver_options(cell, paths);
        work
    }
    let (parts, status) = match part.as_str() {
        "acquisition" => (Parts::Acquisition(bus(&cell, &paths)), paths.acquisition_socket()),
        "estimation" => (Parts::Estimation(work(&cell, &paths)), paths.status_socket()),
        _ => (Parts::Both(bus(&cell, &paths), work(&cell, &paths)), paths.status_socket()),
    };
    let socket = |path, mode| Some(SocketOptions::new(path, mode));
    let estimates = part != "acquisition";
    let options = ServiceOptions {
        status: socket(status, 0o660),
        control: if estimates { socket(paths.command_socket(), 0o600) } else { None },
        external_torque: cell.contact.as_ref().map(|_| SocketOptions {
            kind: SocketKind::Packets,
            ..SocketOptions::new(paths.external_torque_socket(), 0o660)
        }),
        receive_buffer: None,
        events: paths.state.as_deref().map(|state| EventSource::Service.file_in(state)),
    };
    let reload = reload_of(file.clone(), cell.clone(), estimates);
    let report = run_with_reload(&options, parts, Some(reload)).unwrap();
    assert_eq!(report.end, ServiceEnd::Signal);
}

/// A cell, and who runs it.
pub(crate) struct Site {
    pub(crate) cell: Installation,
    pub(crate) network: Network,
}

impl Site {
    pub(crate) fn new(changes: &[(&str, &str)]) -> Self {
        Self { cell: Installation::from_cell("tx40-packed-fd", changes), network: Network::new() }
    }

    pub(crate) fn start(&self, part: &str) -> (Process, Manager) {
        self.start_as(part, self.child())
    }

    /// What runs it.
    pub(crate) fn child(&self) -> Command {
        self.network.child("program::cell::child_runs_a_cell")
    }

    /// The same by another command that ends in the child.
    pub(crate) fn start_as(&self, part: &str, mut command: Command) -> (Process, Manager) {
        let name = format!("notify-{part}");
        let _ = fs::remove_file(self.cell.path(&name));
        let manager = Manager::listen(&self.cell.path(""), &name);
        command.env("DIDIM_TEST_CELL", self.cell.cell()).env("DIDIM_TEST_PART", part);
        manager.manages(&mut command, None);
        (Process(command.spawn().unwrap()), manager)
    }

    pub(crate) fn paths(&self) -> Paths {
        Paths::with_sockets_in(&self.cell.runtime())
    }

    pub(crate) fn status(&self) -> Snapshot {
        fetch_status(&self.paths().status_socket()).unwrap()
    }

    pub(crate) fn ask(&self, request: &Request) -> Result<(), String> {
        match send_request(&self.paths().command_socket(), request) {
            Ok(_) => Ok(()),
            Err(ClientError::Refused { why }) => Err(why),
            Err(other) => panic!("{other}"),
        }
    }

    pub(crate) fn change(&self, changes: &[(&str, &str)]) {
        let text = fs::read_to_string(self.cell.cell()).unwrap();
        fs::write(self.cell.cell(), changed(&text, changes)).unwrap();
    }

    pub(crate) fn hash(&self) -> String {
        Cell::read(&self.cell.cell()).unwrap().configuration_sha256
    }

    /// Identifies the open window as soon as enough of it counts.
    pub(crate) fn identify_now(&self) {
        eventually("enough of a window counts", || {
            let asked = self.ask(&Request::Window(worker::Command::Identify));
            if let Err(why) = &asked {
                assert!(why.contains("too little") || why.contains("no window"), "{why}");
                std::thread::sleep(Duration::from_millis(100));
            }
            asked.is_ok()
        });
    }
}
