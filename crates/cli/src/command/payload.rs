//! `didim payload`: finds the payload of the arm in a recording, from a stored result of the arm
//! without the payload.

use std::path::PathBuf;

use clap::Args;
use didim_identification::identification::{DeclaredLoad, Payload, PayloadError};
use serde::Serialize;

use crate::CliError;
use crate::input::{Samples, parse_point, parse_positive};
use crate::names::DEFAULT_CELL;
use crate::output::print;
use crate::progress::WorkIndicator;
use crate::stream::InputFileOrStream;
use crate::terminal::print_for_terminal;
use crate::torque_joints::TorqueJoints;
use didim::analysis::{LoadError, OTHER_CONFIGURATION, StoredModel, measurement_pairs};
use didim::report::payload_text;
use didim_formats::RecordingStart;

/// Version of the layout of `--json`.
const SCHEMA: u32 = 1;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The result of the arm without the payload: a file that the service stored, or the output of
    /// `didim identify --json`
    #[arg(long, value_name = "FILE")]
    result: PathBuf,
    /// The recording with the payload: a table (CSV, Parquet), or a candump log or an MCAP
    /// recording of the cell's bus
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    #[command(flatten)]
    samples: Samples,
    #[command(flatten)]
    torque_joints: TorqueJoints,
    /// Declared mass of the payload [kg]
    #[arg(long, value_name = "KG", value_parser = parse_positive, allow_negative_numbers = true)]
    declared_mass_kg: Option<f64>,
    /// Declared centre of mass, in the frame of the last link [m]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
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
    /// Start time of the recording, if its time stamps contain it.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    #[serde(flatten)]
    payload: &'a Payload,
    /// True if the result was identified with this configuration; `None` if the result does not
    /// name its configuration.
    same_configuration: Option<bool>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = arguments.torque_joints.read_cell(&arguments.cell)?;
    let (model, cell) =
        StoredModel::read_stored_model(&arguments.result, cell).map_err(CliError::from_failure)?;
    let input = InputFileOrStream::open(&arguments.input)?;
    let parts = arguments.samples.read(&input, &cell)?;
    let declared =
        DeclaredLoad { mass_kg: arguments.declared_mass_kg, centre_m: arguments.declared_centre_m };
    let working = WorkIndicator::start("finding the load");
    let outcome =
        working.show_during(|| model.payload(&cell, &measurement_pairs(&parts), declared));
    let payload = outcome.map_err(|error| match error {
        LoadError::Payload(
            PayloadError::NoCovariance
            | PayloadError::Covariance
            | PayloadError::NotIdentified { .. },
        ) => CliError::in_file(&arguments.result, error),
        error => CliError::in_file(input.displayed_path(), error),
    })?;
    let same_configuration = model.is_of(&cell);
    if arguments.json {
        let robot = cell.robot.name();
        let recorded = parts.first().and_then(|first| first.recording_start);
        let output =
            Output { schema: SCHEMA, robot, recorded, payload: &payload, same_configuration };
        let json = serde_json::to_string(&output).map_err(CliError::from_failure)?;
        return print(&format!("{json}\n"));
    }
    let mut text = payload_text(&payload, declared, &cell.robot);
    if same_configuration == Some(false) {
        text += &format!("note: {OTHER_CONFIGURATION}\n");
    }
    print_for_terminal(&text)
}
