//! `didim sim`: runs the simulated arm as a device on a bus, or writes its signals to a table.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use didim_drivers::source::{CandumpWriter, InterfaceName, StampDigits};
use didim_dynamics::robot::TorqueTerm;
use didim_dynamics::trajectory::SampledReference;
use didim_formats::{Measurement, Side, read_motion, write_csv};
use didim_sim::{CandumpSink, Pace, PlaybackResult, Scenario, SocketCanSink, VirtualDevice, play};
use serde::Serialize;

use crate::CliError;
use crate::frame::note_lines;
use crate::names::{DEFAULT_CELL, RESULT_FILE};
use crate::next::NextCommand;
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
    #[arg(long, value_name = "BUS", required_unless_present = "out", conflicts_with = "out")]
    bus: Option<BusAddress>,
    /// A table of the motors' signals instead (*.csv), at the rate of the scenario's controller and
    /// without the faults of its frames
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fast", "repeat"])]
    out: Option<PathBuf>,
    /// With --out: print one JSON object with the true parameters and nothing else
    #[arg(long, requires = "out")]
    json: bool,
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
    let destination = match (&arguments.bus, &arguments.out) {
        (_, Some(path)) => return write_table(arguments, path, &cell),
        (Some(bus), None) => bus,
        (None, None) => return Err(CliError::Usage("give --bus or --out".to_owned())),
    };
    match destination {
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
    let played = match destination {
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
    let lateness = match (pace, destination) {
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
        destination
    ))
}

/// Version of the layout of `--json`.
const SCHEMA: u32 = 1;

/// Output of `--json`.
#[derive(Serialize)]
struct Output<'a> {
    schema: u32,
    scenario: &'a str,
    robot: &'a str,
    samples: usize,
    sample_rate_hz: f64,
    /// True base parameters of the arm without a payload, in SI units.
    truth: Vec<TrueValue<'a>>,
}

#[derive(Serialize)]
struct TrueValue<'a> {
    name: &'a str,
    value: f64,
}

/// Writes the signals of the motors as a table, with the rests of the scenario's playback.
fn write_table(arguments: &Arguments, path: &PathBuf, cell: &Cell) -> Result<(), CliError> {
    let read = [&arguments.cell, &cell.robot_file, Path::new(&arguments.scenario)];
    check_outputs([path], &read)?;
    let scenario = changed_scenario(arguments, read_scenario(&arguments.scenario, cell)?)?;
    let sample_rate_hz = scenario.controller().timing.sample_period_s().recip();
    let rests = scenario.playback();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the scenario's rests are not negative; saturates"
    )]
    let [before, after] =
        [rests.lead_in_s, rests.tail_s].map(|rest_s| (rest_s * sample_rate_hz).round() as usize);
    let record = scenario.record_with_rests(before, after).map_err(CliError::from_failure)?;
    let signals = record.motor_signals();
    let measurement = Measurement { side: Side::Motor, signals, rate_unchecked: false };
    write_whole(path, |out| write_csv(&measurement, out, path).map_err(CliError::from_failure))?;
    let (samples, robot) = (measurement.samples(), cell.robot.name());
    if !arguments.json {
        let (name, file) = (scenario.name(), path.display());
        print(&format!("{name}: {samples} samples at {sample_rate_hz} Hz in {file}\n"))?;
        let next = NextCommand::new("identify")
            .with_option("--cell", &arguments.cell)
            .with_option("--input", path)
            .with_option("--out", RESULT_FILE);
        print_note(&next.to_string());
        return Ok(());
    }
    let truth = scenario.truth().iter().map(|(name, value)| TrueValue { name, value: *value });
    let truth = truth.collect();
    let scenario = scenario.name();
    let output = Output { schema: SCHEMA, scenario, robot, samples, sample_rate_hz, truth };
    let json = serde_json::to_string(&output).map_err(CliError::from_failure)?;
    print(&format!("{json}\n"))
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
    let excluded = cell.robot.recorded_torque().excluded_terms();
    if !excluded.is_empty() {
        let terms: Vec<String> = excluded.iter().map(TorqueTerm::to_string).collect();
        print_note(&format!(
            "note: the cell excludes {} from its torques, and the simulated torques contain it; \
             leave out `excludes` to identify them\n",
            terms.join(" and ")
        ));
    }
    Ok(scenario)
}
