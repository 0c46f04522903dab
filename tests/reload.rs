//! A cell's service in real processes: its file read again while it runs, and halves that are killed.
//! The bus is in the process, and the simulated arm on it moves all the time.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use common::manager::{Manager, send, terminate};
use common::program::{Installation, changed, json, results, succeed};
use common::{Network, Process, eventually};
use didim::cell::Cell;
use didim::identify::LastIdentification;
use didim::pipeline::{Places, acquisition, estimation};
use didim::reload::reload_of;
use didim::service::{Parts, ServiceEnd, ServiceOptions, SocketOptions, run_with_reload};
use didim::status::{ClientError, Request, Snapshot, fetch_status, send_request};
use didim::stream::Pace;
use didim::worker::{Command, WindowState};
use didim_drivers::source::{InterfaceName, WhenFull, in_process_bus};
use didim_sim::{InProcessSink, VirtualDevice, play};
use rustix::process::Signal;

/// The cell of the folder, or a part of it, as `didim run` runs it but for its bus.
#[test]
#[ignore = "the other process of a test"]
fn child_runs_a_cell() {
    let Some(Network { prefix, .. }) = Network::inherited() else { return };
    let file = PathBuf::from(std::env::var_os("DIDIM_TEST_CELL").unwrap());
    let part = std::env::var("DIDIM_TEST_PART").unwrap();
    let folder = file.parent().unwrap();
    let cell = Cell::read(&file).unwrap();
    let places = Places { runtime: folder.join("run"), state: Some(folder.join("state")), prefix };
    places.make().unwrap();
    let bus = || {
        let mut scenario = didim_sim::tx40_paper().unwrap();
        let mut playback = scenario.playback();
        playback.cycles = None;
        scenario = scenario.with_playback(playback).unwrap();
        let name = InterfaceName::new("sim").unwrap();
        let (sender, source) = in_process_bus(&[name], 65_536, WhenFull::Wait);
        let (layout, scales) = (cell.layout.clone(), cell.scales.clone());
        let mut device = VirtualDevice::new(&scenario, layout, scales, 0).unwrap();
        std::thread::spawn(move || {
            let mut sink = InProcessSink::new(sender);
            let pace = didim_sim::Pace::RealTime;
            let _ = play(&mut device, &mut sink, pace, &AtomicBool::new(false));
        });
        acquisition(&cell, &places, Box::new(source), Pace::Live).unwrap()
    };
    let work = || estimation(&cell, &places, &LastIdentification::default()).unwrap();
    let (parts, status) = match part.as_str() {
        "acquisition" => (Parts::Acquisition(bus()), places.acquisition_socket()),
        "estimation" => (Parts::Estimation(work()), places.status_socket()),
        _ => (Parts::Both(bus(), work()), places.status_socket()),
    };
    let socket = |path, mode| Some(SocketOptions { path, mode, group: None });
    let estimates = part != "acquisition";
    let options = ServiceOptions {
        status: socket(status, 0o660),
        control: if estimates { socket(places.command_socket(), 0o600) } else { None },
        receive_buffer: None,
    };
    let reload = reload_of(file.clone(), cell.clone(), places.clone(), estimates);
    let report = run_with_reload(&options, parts, Some(reload)).unwrap();
    assert_eq!(report.end, ServiceEnd::Signal);
}

/// A cell, and who runs it.
struct Site {
    cell: Installation,
    network: Network,
}

impl Site {
    fn new(changes: &[(&str, &str)]) -> Self {
        Self { cell: Installation::of("tx40-packed-fd", changes), network: Network::new() }
    }

    fn start(&self, part: &str) -> (Process, Manager) {
        let name = format!("notify-{part}");
        let _ = fs::remove_file(self.cell.path(&name));
        let manager = Manager::listen(&self.cell.path(""), &name);
        let mut command = self.network.child("child_runs_a_cell");
        command.env("DIDIM_TEST_CELL", self.cell.cell()).env("DIDIM_TEST_PART", part);
        manager.manages(&mut command, None);
        (Process(command.spawn().unwrap()), manager)
    }

    fn places(&self) -> Places {
        Places::with_sockets_in(&self.cell.runtime())
    }

    fn status(&self) -> Snapshot {
        fetch_status(&self.places().status_socket()).unwrap()
    }

    fn ask(&self, request: &Request) -> Result<(), String> {
        match send_request(&self.places().command_socket(), request) {
            Ok(()) => Ok(()),
            Err(ClientError::Refused { why }) => Err(why),
            Err(other) => panic!("{other}"),
        }
    }

    fn change(&self, changes: &[(&str, &str)]) {
        let text = fs::read_to_string(self.cell.cell()).unwrap();
        fs::write(self.cell.cell(), changed(&text, changes)).unwrap();
    }

    fn hash(&self) -> String {
        Cell::read(&self.cell.cell()).unwrap().configuration_sha256
    }

    /// Identifies the open window as soon as enough of it counts.
    fn identify_now(&self) {
        eventually("enough of a window counts", || {
            let asked = self.ask(&Request::Window(Command::Identify));
            if let Err(why) = &asked {
                assert!(why.contains("too little") || why.contains("no window"), "{why}");
                std::thread::sleep(Duration::from_millis(100));
            }
            asked.is_ok()
        });
    }
}

/// What a reload tells the manager: both words in their order, the first with its time.
fn reloaded(manager: &mut Manager, after: usize) -> String {
    let (number, begins) = manager.expect(after, "RELOADING=1");
    let time = begins.lines().find_map(|line| line.strip_prefix("MONOTONIC_USEC="));
    let now = didim_drivers::socket::monotonic_ns() / 1000;
    let told: u64 = time.unwrap().parse().unwrap();
    assert!(told <= now && now - told < 60_000_000, "{told} µs of {now} µs");
    manager.expect(number, "READY=1").1
}

fn refused(status: &Snapshot) -> Option<&String> {
    status.health.reasons.iter().find(|reason| reason.starts_with("reload refused"))
}

const SHORT: (&str, &str) = ("min_s = 3.0", "min_s = 1.0");

#[test]
fn another_configuration_is_valid_from_the_next_window_on_and_costs_no_sample() {
    let site = Site::new(&[SHORT]);
    let (mut child, mut manager) = site.start("both");
    manager.expect(0, "READY=1");
    let first = site.hash();
    eventually(
        "a window is open",
        || matches!(site.status().estimation.unwrap().window, WindowState::Open { samples } if samples > 2000),
    );

    // By signal, in the middle of a window.
    site.change(&[("cutoff_hz = 200.0", "cutoff_hz = 150.0")]);
    let second = site.hash();
    assert_ne!(first, second);
    let so_far = manager.count();
    send(&child, Signal::HUP);
    reloaded(&mut manager, so_far);
    let work = site.status().estimation.unwrap();
    assert_eq!((work.configuration.as_str(), work.configuration_waits), (first.as_str(), true));
    site.identify_now();
    eventually("the next window has the next configuration", || {
        let work = site.status().estimation.unwrap();
        work.configuration == second && !work.configuration_waits
    });
    site.identify_now();

    // By command, and a broken file: told, and the one before goes on.
    site.change(&[("[identification]\n", "[identification]\nwindow = 3\n")]);
    let so_far = manager.count();
    let why = site.ask(&Request::Reload).unwrap_err();
    assert!(why.contains("cell.toml") && why.contains("unknown field `window`"), "{why}");
    let line = reloaded(&mut manager, so_far);
    assert!(line.contains("reload refused") && line.contains("`window`"), "{line}");
    assert!(refused(&site.status()).is_some());
    assert_eq!(site.status().estimation.unwrap().configuration, second);

    // The bus cannot change, and is named.
    site.change(&[("window = 3\n", "")]);
    for (from, to, key) in [
        ("\"can:vcan0\"", "\"can:vcan1\"", "bus.source"),
        ("zero = 0.0", "zero = 1.0", "bus.drives"),
        ("keep_results = 7", "keep_results = 8", "service.keep_results"),
        ("name = \"tx40-packed-fd\"", "name = \"another\"", "name"),
    ] {
        if key == "service.keep_results" {
            site.change(&[("[service]", "[service]\nkeep_results = 7")]);
        }
        site.change(&[(from, to)]);
        let why = site.ask(&Request::Reload).unwrap_err();
        assert!(why.contains(&format!("`{key}`")) && why.contains("restart"), "{why}");
        assert!(refused(&site.status()).unwrap().contains(key));
        site.change(&[(to, from)]);
        if key == "service.keep_results" {
            site.change(&[("[service]\nkeep_results = 7", "[service]")]);
        }
    }

    // Good again, with other windows; `didim reload` as people use it.
    let motion = "by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5";
    site.change(&[(motion, "by = \"command\"")]);
    succeed(&[&"reload", &"--runtime", &site.cell.runtime()]);
    assert_eq!(refused(&site.status()), None);
    site.identify_now();
    eventually("windows are by command", || site.ask(&Request::Window(Command::Begin)).is_ok());

    let third = site.hash();
    eventually("three windows are identified", || {
        let work = site.status().estimation.unwrap();
        work.windows_identified == 3 && work.configuration == third
    });
    let work = site.status().estimation.unwrap();
    assert_eq!((work.samples_missing, work.batches_lost, work.restarts), (0, 0, 0));
    let (status, _) = terminate(&mut child);
    assert!(status.success(), "{status}");
    let configurations: Vec<String> = results(&site.cell.state())
        .iter()
        .map(|result| json(result)["configuration"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(configurations, [first, second.clone(), second]);
}

/// The status as `didim status` shows it, of both halves.
fn merged(site: &Site) -> serde_json::Value {
    json(&succeed(&[&"status", &"--json", &"--runtime", &site.cell.runtime()]))
}

fn has_reason(status: &serde_json::Value, words: &str) -> bool {
    let reasons = status["health"]["reasons"].as_array().unwrap();
    reasons.iter().any(|reason| reason.as_str().unwrap().contains(words))
}

#[test]
fn either_half_may_be_killed_and_the_other_goes_on() {
    let site = Site::new(&[SHORT, ("[service]", "[service]\nprocesses = \"two\"")]);
    let acquisition_status = || fetch_status(&site.places().acquisition_socket()).unwrap();
    // The estimation comes first, and is ready although nobody sends.
    let (mut work, mut of_work) = site.start("estimation");
    of_work.expect(0, "READY=1");
    eventually("it says that nothing comes", || {
        site.status().health.reasons.iter().any(|why| why.contains("no sample has come"))
    });
    let (mut bus, mut of_bus) = site.start("acquisition");
    of_bus.expect(0, "READY=1");
    eventually("samples", || site.status().estimation.unwrap().samples > 1000);
    assert!(!has_reason(&merged(&site), "no sample has come"));

    // The acquisition looks at what concerns it.
    site.change(&[("\"can:vcan0\"", "\"can:vcan1\"")]);
    let so_far = of_bus.count();
    send(&bus, Signal::HUP);
    reloaded(&mut of_bus, so_far);
    assert!(has_reason(&merged(&site), "acquisition: reload refused"));
    site.change(&[("\"can:vcan1\"", "\"can:vcan0\"")]);
    let so_far = of_bus.count();
    send(&bus, Signal::HUP);
    reloaded(&mut of_bus, so_far);
    assert!(!has_reason(&merged(&site), "reload refused"));

    // Without the acquisition.
    send(&bus, Signal::KILL);
    bus.0.wait().unwrap();
    eventually("it says that nothing comes any more", || {
        let status = merged(&site);
        has_reason(&status, "no sample has come")
            && has_reason(&status, "the acquisition does not answer")
    });
    let before = site.status().estimation.unwrap();
    (bus, of_bus) = site.start("acquisition");
    of_bus.expect(0, "READY=1");
    eventually("samples again", || {
        let after = site.status().estimation.unwrap();
        after.samples > before.samples + 1000 && after.restarts == before.restarts + 1
    });
    site.identify_now();
    eventually("a window of the new acquisition", || {
        site.status().estimation.unwrap().windows_identified == 1
    });

    // Without the estimation.
    send(&work, Signal::KILL);
    work.0.wait().unwrap();
    let before = acquisition_status().acquisition.unwrap().samples;
    eventually("the acquisition goes on", || {
        acquisition_status().acquisition.unwrap().samples > before + 1000
    });
    assert!(has_reason(&merged(&site), "the estimation does not answer"));
    (work, of_work) = site.start("estimation");
    of_work.expect(0, "READY=1");
    eventually("samples again", || site.status().estimation.unwrap().samples > 1000);
    for child in [&mut work, &mut bus] {
        let (status, _) = terminate(child);
        assert!(status.success(), "{status}");
    }
    assert!(!Path::new(&site.places().status_socket()).exists());
}
