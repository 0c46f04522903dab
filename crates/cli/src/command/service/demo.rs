//! `didim demo`: runs the simulated arm through the complete pipeline, in one process.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use clap::Args;
use didim_drivers::frame::Frame;
use didim_drivers::source::{InProcessSender, InterfaceName, WhenFull, in_process_bus};
use didim_dynamics::robot::Robot;
use didim_identification::identification::{Identification, Method};
use didim_sim::{
    InProcessSink, Pace as PlayPace, PlayError, PlaybackResult, Scenario, Sink, SinkError,
    VirtualDevice, play,
};
use indicatif::ProgressBar;

use crate::CliError;
use crate::names::method_parser;
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::outcome::last_identification;
use crate::output::{check_outputs, count_with_noun, print, write_figure, write_report};
use crate::progress::style_bar;
use crate::terminal::{print_for_terminal, width};
use didim::analysis::identify::{LastIdentification, LastWindow};
use didim::cell::{Cell, Library};
use didim::live::stream::Pace;
use didim::live::worker::TimeOfDay;
use didim::report;
use didim::report::html::{Origin, Report, SampleRange};
use didim::report::terminal::torque_plot;
use didim::service::pipeline::{OneRun, build_acquisition, build_estimation};
use didim::service::status::Snapshot;
use didim::service::supervision::{Parts, ServiceOptions, ServiceReport, run};

/// Cell file of the demonstration. The program contains a copy of it.
const DEMO_CELL: &str = "config/cells/tx40-packed-fd.toml";
/// Capacity of the in-process bus \[frames\]: one second at 5 kHz.
const BUS_FRAMES: usize = 5000;
/// Number of frames between two steps of the progress bar.
const PROGRESS_FRAMES: u64 = 250;
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The method
    #[arg(long, value_name = "METHOD", value_parser = method_parser(),
        default_value_t = Method::IdimLs)]
    method: Method,
    /// Duration of the motion, rests included; the motion is repeated until then [default: once,
    /// 7.9 s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Seed of the noise
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Run as fast as the pipeline accepts the frames, not in real time
    #[arg(long)]
    fast: bool,
    /// The file for the figure of measured against predicted torque
    #[arg(long, value_name = "FILE", default_value = "didim-demo.svg")]
    figure: PathBuf,
    /// Write a report (one HTML file), as `identify` does
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    check_outputs([&arguments.figure].into_iter().chain(&arguments.report), &[])?;
    let mut cell = Cell::from_library(Library::SHIPPED, Path::new(DEMO_CELL))
        .map_err(CliError::from_configuration)?;
    cell.method = arguments.method;
    let scenario = scenario(arguments)?;
    let bus = cell.bus().map_err(CliError::from_configuration)?;
    let device = VirtualDevice::new(&scenario, bus.layout.clone(), bus.scales.clone(), 0)
        .map_err(CliError::from_failure)?;
    let cycles = cycle_count(arguments, &device, &cell)?;
    print_for_terminal(&format!(
        "A simulated {} whose parameters are known: its drives send {:.0} CAN FD\n\
         frames a second over an in-process bus, shared memory carries the samples to\n\
         the worker, and {} identifies.\n\n",
        cell.robot.name(),
        cell.sample_rate_hz(),
        cell.method
    ))?;

    let one_run = OneRun::new(None).map_err(CliError::from_failure)?;
    let paths = &one_run.paths;
    let name = InterfaceName::new("sim").map_err(CliError::from_failure)?;
    let (sender, source) = in_process_bus(&[name], BUS_FRAMES, WhenFull::Wait);
    let last = LastIdentification::default();
    // At maximum speed, no frames may be dropped; in real time, the pipeline has to keep up.
    let pace = if arguments.fast { Pace::Replay } else { Pace::Live };
    let mut work = build_estimation(&cell, paths, &last).map_err(CliError::from_failure)?;
    // The time stamps of the device count from its start.
    work.options.time_of_day = TimeOfDay::Log { since_1970_ns: 0 };
    let parts = Parts::Both(
        build_acquisition(&cell, paths, Box::new(source), pace).map_err(CliError::from_failure)?,
        work,
    );
    let stop = Arc::new(AtomicBool::new(false));
    let arm =
        start_arm(device, sender, cycles, arguments.fast, &stop).map_err(CliError::from_failure)?;
    let report = run(&ServiceOptions::default(), parts);
    stop.store(true, Ordering::Relaxed);
    let played = arm.join().map_err(|_| CliError::from_failure("the simulated arm panicked"))?;
    let report: ServiceReport = report.map_err(CliError::from_failure)?;
    match played {
        // A signal ended the service before the end of the playback.
        Err(PlayError::Sink(SinkError::Closed(_))) | Ok(_) => {}
        Err(error) => return Err(CliError::from_failure(error)),
    }
    let LastWindow { window, identification } = last_identification(&report, &last)?;
    print_for_terminal(&text(&identification, &cell.robot, &scenario, &report.snapshot))?;
    // The figure is written after the result, so that a write error does not cost the result.
    write_figure(&arguments.figure, &cell, &identification)?;
    print(&format!("figure of all joints: {}\n", arguments.figure.display()))?;
    print_note(&NextCommand::with_report(arguments.report.as_ref(), false));
    let Some(path) = &arguments.report else { return Ok(()) };
    let samples = SampleRange::Window(window);
    let origin = Origin { input: None, samples, further_files: Vec::new(), note: None };
    write_report(path, &Report::new(&cell, &identification, &origin))?;
    print(&format!("report: {}\n", path.display()))
}

fn scenario(arguments: &Arguments) -> Result<Scenario, CliError> {
    let mut scenario = didim_sim::tx40_paper().map_err(CliError::from_failure)?;
    if let Some(seed) = arguments.seed {
        scenario = scenario.with_seed(seed);
    }
    if arguments.seconds.is_some() {
        let mut playback = scenario.playback();
        playback.cycles = None;
        scenario = scenario.with_playback(playback).map_err(CliError::from_failure)?;
    }
    Ok(scenario)
}

/// Returns the number of bus cycles to play.
fn cycle_count(
    arguments: &Arguments,
    device: &VirtualDevice,
    cell: &Cell,
) -> Result<u64, CliError> {
    let Some(seconds) = arguments.seconds else { return Ok(device.cycle_count()) };
    // The cell requires three seconds of motion, with half a second of rest and the window's margin
    // before and after it.
    if !(5.0..=86_400.0).contains(&seconds) {
        return Err(CliError::Usage(format!("--seconds {seconds}: has to be 5 to 86400")));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a day")]
    Ok((seconds * cell.sample_rate_hz()).round() as u64)
}

/// Starts the thread that simulates the arm and sends its frames.
fn start_arm(
    mut device: VirtualDevice,
    sender: InProcessSender,
    cycles: u64,
    fast: bool,
    stop: &Arc<AtomicBool>,
) -> std::io::Result<JoinHandle<Result<PlaybackResult, PlayError>>> {
    let stop = Arc::clone(stop);
    std::thread::Builder::new().name("simulated arm".into()).spawn(move || {
        let mut sink = ProgressSink {
            bus: InProcessSink::new(sender),
            bar: progress_bar(cycles),
            cycles_left: cycles,
            stop: Arc::clone(&stop),
        };
        let pace = if fast { PlayPace::Unpaced } else { PlayPace::RealTime };
        let played = play(&mut device, &mut sink, pace, &stop);
        sink.bar.finish_and_clear();
        played
    })
}

fn progress_bar(cycles: u64) -> ProgressBar {
    let template = "{bar:40} {percent:>3} %  {pos}/{len} frames  {elapsed}";
    style_bar(ProgressBar::new(cycles), template)
}

/// In-process bus with a progress bar. The sink stops the playback after the last frame.
struct ProgressSink {
    bus: InProcessSink,
    bar: ProgressBar,
    cycles_left: u64,
    stop: Arc<AtomicBool>,
}

impl Sink for ProgressSink {
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError> {
        self.bus.send(frame)?;
        self.cycles_left = self.cycles_left.saturating_sub(1);
        if self.cycles_left.is_multiple_of(PROGRESS_FRAMES) {
            self.bar.inc(PROGRESS_FRAMES);
        }
        if self.cycles_left == 0 {
            self.stop.store(true, Ordering::Relaxed);
        }
        Ok(())
    }
}

fn text(
    identification: &Identification,
    robot: &Robot,
    scenario: &Scenario,
    snapshot: &Snapshot,
) -> String {
    let estimate = &identification.estimate;
    let mut text = report::estimate::truth_table(estimate, &|name| scenario.truth_of(name));
    text += "\n";
    text += &report::estimate::summary(estimate, robot);
    text += "\n";
    // The joint with the largest torque is the most informative one.
    let peak = |values: &[f64]| values.iter().fold(0.0_f64, |peak, v| peak.max(v.abs()));
    let panels = report::joint_panels(identification, robot);
    let largest = panels.iter().max_by(|a, b| peak(a.measured_nm).total_cmp(&peak(b.measured_nm)));
    if let Some(panel) = largest {
        text += &torque_plot(panel, width());
        text += "\n";
    }
    if let (Some(bus), Some(work)) = (&snapshot.acquisition, &snapshot.estimation) {
        text += &format!(
            "{}, {}, {} lost; {} identified, {} rejected\n",
            count_with_noun(bus.frames, "frame"),
            count_with_noun(bus.samples, "sample"),
            bus.counters.queue_drops + bus.cycles_lost.values().sum::<u64>(),
            count_with_noun(work.windows_identified, "window"),
            work.windows_rejected.values().sum::<u64>()
        );
    }
    text
}
