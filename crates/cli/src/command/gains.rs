//! `didim gains`: finds unknown torque gains, from recordings without and with a known load.

use std::path::PathBuf;

use clap::Args;
use didim_identification::identification::KnownLoad;
use serde::Serialize;

use crate::CliError;
use crate::input::{Samples, parse_point, parse_positive};
use crate::names::DEFAULT_CELL;
use crate::output::print;
use crate::progress::WorkIndicator;
use crate::stream::InputFileOrStream;
use crate::terminal::print_for_terminal;
use didim::analysis::{FoundGains, find_drive_gains, measurement_pairs};
use didim::cell::Cell;
use didim::report::gains_text;

/// Version of the `--json` layout.
const SCHEMA: u32 = 1;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The recording without the load: a table (CSV, Parquet), or a candump log or an MCAP
    /// recording of the cell's bus
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    /// The recording with the load; without one, gains and parameters are in units of one drive
    #[arg(long, value_name = "FILE", requires_all = ["declared_mass_kg", "declared_centre_m"])]
    loaded: Option<PathBuf>,
    #[command(flatten)]
    samples: Samples,
    /// Mass of the load, weighed [kg]
    #[arg(
        long,
        value_name = "KG",
        value_parser = parse_positive,
        allow_negative_numbers = true,
        requires = "loaded"
    )]
    declared_mass_kg: Option<f64>,
    /// Centre of mass of the load, in the frame of the last link [m]
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_parser = parse_point,
        allow_hyphen_values = true,
        requires = "loaded"
    )]
    declared_centre_m: Option<[f64; 3]>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Output<'a> {
    schema: u32,
    robot: &'a str,
    #[serde(flatten)]
    found: &'a FoundGains,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::from_configuration)?;
    let read = |file| -> Result<_, CliError> {
        let input = InputFileOrStream::open(file)?;
        arguments.samples.read(&input, &cell)
    };
    let empty = read(&arguments.input)?;
    let loaded = arguments.loaded.as_deref().map(read).transpose()?;
    let Arguments { declared_mass_kg, declared_centre_m, .. } = *arguments;
    let load = declared_mass_kg.zip(declared_centre_m);
    let load = load.map(|(mass_kg, centre_m)| KnownLoad { mass_kg, centre_m });
    let loaded = loaded.as_deref().map(measurement_pairs).zip(load);
    let working = WorkIndicator::start("finding the gains");
    let load_of_recording = loaded.as_ref().map(|(of, load)| (&of[..], *load));
    let empty = measurement_pairs(&empty);
    let outcome = working.show_during(|| find_drive_gains(&cell, &empty, load_of_recording));
    let gains = outcome.map_err(CliError::from_failure)?;
    if arguments.json {
        let output = Output { schema: SCHEMA, robot: cell.robot.name(), found: &gains };
        let json = serde_json::to_string(&output).map_err(CliError::from_failure)?;
        return print(&format!("{json}\n"));
    }
    print_for_terminal(&gains_text(&gains, &cell.robot))
}
