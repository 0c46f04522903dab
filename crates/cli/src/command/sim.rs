//! `didim sim`: runs the simulated arm as a device on a bus.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use didim_drivers::source::{CandumpWriter, InterfaceName, StampDigits};
use didim_dynamics::trajectory::SampledReference;
use didim_formats::read_motion;
use didim_sim::{CandumpSink, Pace, PlaybackResult, Scenario, SocketCanSink, VirtualDevice, play};

use crate::CliError;
use crate::frame::note_lines;
use crate::names::DEFAULT_CELL;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_whole};
use didim::cell::{BusAddress, Cell};
use didim::files::read_text;
use didim::signals::stop_flag;
use didim_lab::study::check_robot;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell whose drives are simulated: it defines the layout of the frames and the gains
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// Destination of the frames: can:INTERFACE, or log:FILE
    #[arg(long, value_name = "BUS")]
    bus: BusAddress,
    /// The scenario to simulate: a file, or one of the shipped tx40-paper, tx40-paper-errors and
    /// tx40-physical
    #[arg(long, value_name = "NAME|FILE", default_value = "tx40-paper")]
    scenario: String,
    /// A motion in the format of `didim design` (.csv), instead of the scenario's
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// Seed of the noise; default: the scenario's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Send as fast as the bus takes frames, instead of at the cell's rate
    #[arg(long)]
    fast: bool,
    /// Repeat the motion until interrupted
    #[arg(long)]
    repeat: bool,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::from_configuration)?;
    match &arguments.bus {
        BusAddress::Can(_) => {}
        BusAddress::Log(_) if arguments.repeat => {
            return Err(CliError::Usage("--repeat would fill the disk with a log".to_owned()));
        }
        BusAddress::Log(path) => {
            let scenario = Path::new(&arguments.scenario);
            check_outputs([path], &[&arguments.cell, &cell.robot_file, scenario])?;
        }
        BusAddress::InProcess => {
            return Err(CliError::Usage(
                "inproc: does not reach other processes; use can:INTERFACE or log:FILE".to_owned(),
            ));
        }
        BusAddress::Pcap(_) | BusAddress::Ethercat(_) => {
            let why =
                "EtherCAT is listened to; use log:FILE, which has the frames of its process data";
            return Err(CliError::Usage(why.to_owned()));
        }
    }
    let scenario = read_scenario(&arguments.scenario, &cell)?;
    let scenario = changed_scenario(arguments, scenario)?;
    let bus = cell.bus().map_err(CliError::from_configuration)?;
    let mut device = VirtualDevice::new(&scenario, bus.layout.clone(), bus.scales.clone(), 0)
        .map_err(CliError::from_configuration)?;
    let stop = stop_flag().map_err(CliError::from_failure)?;
    let pace = if arguments.fast { Pace::Unpaced } else { Pace::RealTime };
    let played = match &arguments.bus {
        BusAddress::Can(interface) => {
            let mut sink =
                SocketCanSink::open(interface.as_str()).map_err(CliError::from_failure)?;
            play(&mut device, &mut sink, pace, &stop).map_err(CliError::from_failure)?
        }
        BusAddress::Log(path) => {
            let mut played = None;
            write_whole(path, |out| {
                let name = [InterfaceName::new("can0").map_err(CliError::from_failure)?];
                let mut sink =
                    CandumpSink::new(CandumpWriter::new(out, &name, StampDigits::Nanoseconds));
                played = Some(
                    play(&mut device, &mut sink, Pace::Unpaced, &stop)
                        .map_err(CliError::from_failure)?,
                );
                sink.finish().map_err(CliError::from_failure)?;
                if stop.load(Ordering::Relaxed) {
                    return Err(CliError::Interrupted(format!(
                        "interrupted; {} was not written",
                        path.display()
                    )));
                }
                Ok(())
            })?;
            played.unwrap_or_default()
        }
        // These buses were refused above.
        BusAddress::InProcess | BusAddress::Pcap(_) | BusAddress::Ethercat(_) => {
            PlaybackResult::default()
        }
    };
    let lateness = match (pace, &arguments.bus) {
        (Pace::RealTime, BusAddress::Can(_)) => {
            format!(", the latest {:.2} ms late", played.largest_delay.as_secs_f64() * 1e3)
        }
        _ => String::new(),
    };
    print(&format!(
        "{}: {} bus cycles, {} frames to {}{lateness}\n",
        scenario.name(),
        played.cycles,
        played.frames,
        arguments.bus
    ))
}

/// Applies the motion, the seed and the repetition of the arguments to the scenario.
fn changed_scenario(arguments: &Arguments, mut scenario: Scenario) -> Result<Scenario, CliError> {
    if let Some(file) = &arguments.motion {
        let points = read_motion(file).map_err(CliError::from_configuration)?;
        let motion = SampledReference::new(points.rate_hz, &points.positions);
        let motion = motion.map_err(CliError::from_configuration)?;
        scenario = scenario.with_recorded_motion(motion).map_err(CliError::from_configuration)?;
    }
    if let Some(seed) = arguments.seed {
        scenario = scenario.with_seed(seed);
    }
    if arguments.repeat {
        let mut playback = scenario.playback();
        playback.cycles = None;
        scenario = scenario.with_playback(playback).map_err(CliError::from_configuration)?;
    }
    Ok(scenario)
}

/// Reads a shipped scenario by its name, or a file for the cell's robot.
pub(super) fn read_scenario(name: &str, cell: &Cell) -> Result<Scenario, CliError> {
    let scenario = match didim_sim::shipped(name) {
        Some(scenario) => scenario,
        None => {
            let text = read_text(Path::new(name)).map_err(|error| {
                let shipped = didim_sim::SHIPPED_SCENARIOS.join(", ");
                CliError::Usage(format!(
                    "--scenario {name}: {error}; name a file, or one of the shipped {shipped}"
                ))
            })?;
            Scenario::from_toml(&text, cell.robot_as_described.clone())
        }
    }
    .map_err(|error| CliError::from_configuration(format!("{name}: {error}")))?;
    check_robot(&scenario, cell)
        .map_err(|error| CliError::from_configuration(format!("{name}: {error}")))?;
    print_note(&note_lines(scenario.findings()));
    Ok(scenario)
}
