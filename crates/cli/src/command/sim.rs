//! `didim sim`: runs the simulated arm as a device on a bus, or writes its signals to a table.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use didim_drivers::source::{CandumpWriter, InterfaceName, StampDigits};
use didim_dynamics::robot::TorqueTerm;
use didim_dynamics::trajectory::SampledReference;
use didim_formats::{Measurement, Side, read_motion, write_csv};
use didim_sim::{
    CandumpSink, ExcludedTorque, Pace, PlaybackResult, Scenario, SocketCanSink, VirtualDevice, play,
};
use serde::Serialize;

use crate::CliError;
use crate::frame::note_lines;
use crate::names::{DEFAULT_CELL, RESULT_FILE};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_whole};
use didim::analysis::PlayedMotion;
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
    /// The scenario to simulate, for the cell's robot: a file, or one of the shipped tx40-paper,
    /// tx40-paper-errors and tx40-physical. When left out: tx40-paper for its robot, and for any
    /// other one the nominal parameters along --motion into --out
    #[arg(long, value_name = "NAME|FILE")]
    scenario: Option<String>,
    /// A motion in the format of `didim design` (.csv), instead of the scenario's
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// Seed of the noise; default: the scenario's, or 1
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Send as fast as the bus takes frames, instead of at the cell's rate
    #[arg(long)]
    fast: bool,
    /// Repeat the motion until interrupted
    #[arg(long)]
    repeat: bool,
}

impl Arguments {
    /// Returns the scenario of the command line, or the default one if it is for this robot. `None`
    /// if the robot has no scenario.
    fn scenario(&self, cell: &Cell) -> Result<Option<Scenario>, CliError> {
        if let Some(name) = &self.scenario {
            return read_scenario(name, cell).map(Some);
        }
        let default = didim_sim::shipped(DEFAULT_SCENARIO);
        let is_of_robot = matches!(&default, Some(Ok(of)) if check_robot(of, cell).is_ok());
        is_of_robot.then(|| read_scenario(DEFAULT_SCENARIO, cell)).transpose()
    }

    /// Returns the scenario like [`Self::scenario`].
    ///
    /// # Errors
    /// The robot has no scenario.
    fn required_scenario(&self, cell: &Cell) -> Result<Scenario, CliError> {
        self.scenario(cell)?.ok_or_else(|| {
            CliError::Usage(format!(
                "no shipped scenario is for the cell's robot `{}`: give --motion FILE and --out \
                 FILE.csv to simulate it along a motion of `didim design`, or --scenario with a \
                 file for it",
                cell.robot.name()
            ))
        })
    }

    /// Returns the files that the command reads.
    fn inputs<'a>(&'a self, cell: &'a Cell) -> Vec<&'a Path> {
        let scenario = self.scenario.as_ref().map(Path::new);
        let motion = self.motion.as_deref();
        [self.cell.as_path(), &cell.robot_file].into_iter().chain(scenario).chain(motion).collect()
    }
}

/// Scenario that is simulated for its robot if none is named.
const DEFAULT_SCENARIO: &str = "tx40-paper";
/// Seed of the noise without a scenario.
const DEFAULT_SEED: u64 = 1;

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::from_configuration)?;
    let destination = match (&arguments.bus, &arguments.out) {
        (_, Some(path)) => return write_table(arguments, path, &cell),
        (Some(bus), None) => bus,
        (None, None) => return Err(CliError::Usage("give --bus or --out".to_owned())),
    };
    check_destination(arguments, destination, &cell)?;
    let scenario = changed_scenario(arguments, arguments.required_scenario(&cell)?)?;
    let bus = cell.bus().map_err(CliError::from_configuration)?;
    let device = VirtualDevice::new(&scenario, bus.layout.clone(), bus.scales.clone(), 0)
        .map_err(CliError::from_configuration)?;
    let mut device = device.with_excluded_torque(excluded_torque(&scenario, &cell));
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
    ))?;
    if let BusAddress::Log(path) = destination {
        print_note(&identify_command(arguments, path));
    }
    Ok(())
}

/// Checks that frames can be sent to a destination.
fn check_destination(
    arguments: &Arguments,
    destination: &BusAddress,
    cell: &Cell,
) -> Result<(), CliError> {
    match destination {
        BusAddress::Can(_) => Ok(()),
        BusAddress::Log(_) if arguments.repeat => {
            Err(CliError::Usage("--repeat would fill the disk with a log".to_owned()))
        }
        BusAddress::Log(path) => check_outputs([path], &arguments.inputs(cell)),
        BusAddress::InProcess => {
            let why = "inproc: does not reach other processes; use can:INTERFACE or log:FILE";
            Err(CliError::Usage(why.to_owned()))
        }
        BusAddress::Pcap(_) | BusAddress::Ethercat(_) => {
            let why =
                "EtherCAT is listened to; use log:FILE, which has the frames of its process data";
            Err(CliError::Usage(why.to_owned()))
        }
    }
}

/// Returns the command that identifies what was written.
fn identify_command(arguments: &Arguments, path: &Path) -> String {
    let next = NextCommand::new("identify")
        .with_option("--cell", &arguments.cell)
        .with_option("--input", path)
        .with_option("--out", RESULT_FILE);
    next.to_string()
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
    check_outputs([path], &arguments.inputs(cell))?;
    let scenario = match (arguments.scenario(cell)?, &arguments.motion) {
        (None, Some(motion)) => return write_played_motion(arguments, path, motion, cell),
        (Some(scenario), _) => scenario,
        (None, None) => arguments.required_scenario(cell)?,
    };
    let scenario = changed_scenario(arguments, scenario)?;
    let sample_rate_hz = scenario.controller().timing.sample_period_s().recip();
    let rests = scenario.playback();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the scenario's rests are not negative; saturates"
    )]
    let [before, after] =
        [rests.lead_in_s, rests.tail_s].map(|rest_s| (rest_s * sample_rate_hz).round() as usize);
    let mut record = scenario.record_with_rests(before, after).map_err(CliError::from_failure)?;
    if let Some(mut excluded) = excluded_torque(&scenario, cell) {
        excluded.subtract_from_record(&mut record);
    }
    let signals = record.motor_signals();
    let measurement = Measurement { side: Side::Motor, signals, rate_unchecked: false };
    write_whole(path, |out| write_csv(&measurement, out, path).map_err(CliError::from_failure))?;
    let truth = scenario.truth();
    report_table(arguments, (path, cell), (scenario.name(), &measurement, truth))
}

/// Writes a recording of the cell's own robot, which follows a motion exactly.
fn write_played_motion(
    arguments: &Arguments,
    path: &Path,
    motion: &Path,
    cell: &Cell,
) -> Result<(), CliError> {
    let points = read_motion(motion).map_err(CliError::from_configuration)?;
    let played = PlayedMotion::new(cell, &points, arguments.seed.unwrap_or(DEFAULT_SEED));
    let PlayedMotion { measurement, truth } =
        played.map_err(|error| CliError::in_file(motion, error))?;
    write_whole(path, |out| write_csv(&measurement, out, path).map_err(CliError::from_failure))?;
    note_excluded_terms(cell);
    if !arguments.json {
        print_note(
            "note: the arm follows the motion exactly; torques of its nominal parameters, with \
             white noise as `didim design` assumes it\n",
        );
    }
    report_table(arguments, (path, cell), ("motion", &measurement, &truth))
}

/// Prints what a table contains: the next command, or the true parameters as JSON.
fn report_table(
    arguments: &Arguments,
    (path, cell): (&Path, &Cell),
    (scenario, measurement, truth): (&str, &Measurement, &[(String, f64)]),
) -> Result<(), CliError> {
    let (samples, robot) = (measurement.samples(), cell.robot.name());
    let sample_rate_hz = measurement.signals.sample_rate_hz;
    if !arguments.json {
        let file = path.display();
        print(&format!("{scenario}: {samples} samples at {sample_rate_hz} Hz in {file}\n"))?;
        print_note(&identify_command(arguments, path));
        return Ok(());
    }
    let truth = truth.iter().map(|(name, value)| TrueValue { name, value: *value });
    let truth = truth.collect();
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
    note_excluded_terms(cell);
    Ok(scenario)
}

/// Notes that the simulated torques lack the terms that the cell excludes.
fn note_excluded_terms(cell: &Cell) {
    let excluded = cell.robot.recorded_torque().excluded_terms();
    if !excluded.is_empty() {
        let terms: Vec<String> = excluded.iter().map(TorqueTerm::to_string).collect();
        let terms = terms.join(" and ");
        print_note(&format!("note: the torques lack {terms}, as the cell says (`excludes`)\n"));
    }
}

/// Returns the torque of the terms that the cell excludes.
fn excluded_torque(scenario: &Scenario, cell: &Cell) -> Option<ExcludedTorque> {
    let terms = cell.robot.recorded_torque().excluded_terms();
    ExcludedTorque::new(scenario.robot(), scenario.standard_parameters(), terms)
}
