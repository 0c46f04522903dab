//! `didim predict`: applies a stored result to another recording, without fitting.

use std::path::{Path, PathBuf};

use clap::Args;
use didim_dynamics::robot::{Joint, JointIndex};
use didim_identification::identification::{Prediction, Use};
use serde::Serialize;

use crate::CliError;
use crate::input::Samples;
use crate::names::DEFAULT_CELL;
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_text};
use crate::progress::WorkIndicator;
use crate::required_uses::RequiredUses;
use crate::stream::InputFileOrStream;
use crate::terminal::print_for_terminal;
use crate::torque_joints::TorqueJoints;
use didim::analysis::{JudgedUse, OTHER_CONFIGURATION, StoredModel, measurement_pairs};
use didim::cell::Cell;
use didim::report::html::{InputFile, PredictionReport};
use didim::text::{align_table, significant_digits};
use didim_formats::RecordingStart;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The result: a file that the service stored, or the file of `didim identify --out`
    #[arg(long, value_name = "FILE")]
    result: PathBuf,
    /// The recording: a table (CSV, Parquet), or a candump log or an MCAP recording of the cell's
    /// bus
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    #[command(flatten)]
    samples: Samples,
    #[command(flatten)]
    torque_joints: TorqueJoints,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    required: RequiredUses,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    prediction: &'a Prediction,
    /// Start time of the recording, if its time stamps contain it.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    /// True if the result was identified with this configuration; `None` if the result does not
    /// name its configuration.
    same_configuration: Option<bool>,
    /// Caveats for the reader of the prediction.
    notes: &'a [String],
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = arguments.torque_joints.read_cell(&arguments.cell)?;
    // Outputs are checked first, so that no work is lost.
    let read: [&Path; 4] = [&arguments.cell, &arguments.result, &arguments.input, &cell.robot_file];
    check_outputs(&arguments.report, &read)?;
    let asked = cell.robot.recorded_torque().clone();
    let (model, cell) =
        StoredModel::read_stored_model(&arguments.result, cell).map_err(CliError::from_failure)?;
    let input = InputFileOrStream::open(&arguments.input)?;
    let parts = arguments.samples.read(&input, &cell)?;
    let recorded = parts.first().and_then(|first| first.recording_start);
    let prediction = WorkIndicator::start("predicting")
        .show_during(|| model.predict(&cell, &measurement_pairs(&parts)))
        .map_err(|error| CliError::in_file(input.displayed_path(), error))?;
    if !prediction.error.relative_error.is_finite() {
        let explanation = "its parameters give no finite torque; give the result as it was stored";
        return Err(CliError::in_file(&arguments.result, explanation));
    }
    let same_configuration = model.is_of(&cell);
    let mut notes = notes(&model, &cell, &prediction, same_configuration);
    let missing = cell.robot.recorded_torque().missing_joints().iter();
    let left_out: Vec<String> = missing
        .filter(|joint| asked.has_joint(**joint))
        .map(|joint| cell.robot.joint_label(*joint))
        .collect();
    if !left_out.is_empty() {
        let joints = left_out.join(", ");
        notes.push(format!("the result was identified without the torque of joint {joints}"));
    }
    if arguments.json {
        let output =
            Output { prediction: &prediction, recorded, same_configuration, notes: &notes };
        let json = serde_json::to_string(&output).map_err(CliError::from_failure)?;
        print(&format!("{json}\n"))?;
    } else {
        print_for_terminal(&text(&prediction, &cell, &notes))?;
    }
    if let Some(path) = &arguments.report {
        let read = |path| InputFile::read(path).map_err(|error| CliError::in_file(path, error));
        let (result, input) = (read(&arguments.result)?, input.input_file()?);
        let report = PredictionReport {
            cell: &cell,
            result: &result,
            input: &input,
            recorded,
            prediction: &prediction,
            notes: &notes,
        };
        write_text(path, &report.to_html())?;
    }
    if !arguments.json {
        print_note(&NextCommand::with_report(arguments.report.as_ref(), input.is_stream()));
    }
    arguments.required.check(|usage| match model.judged_use(usage) {
        Some(judged) => judged.clone(),
        None => JudgedUse {
            usage,
            applicable: None,
            reasons: vec!["it has no verdict on this use".to_owned()],
        },
    })
}

/// Returns the caveats of a prediction.
fn notes(
    model: &StoredModel,
    cell: &Cell,
    prediction: &Prediction,
    same_configuration: Option<bool>,
) -> Vec<String> {
    let mut notes = model.refusals(&[Use::Prediction]);
    if prediction.expected_error.is_none() {
        notes.push(
            "the result does not state the expected error: it is from an earlier version, from \
                other parameters or filters, or was changed"
                .to_owned(),
        );
    }
    let recorded = cell.robot.recorded_torque();
    let terms: Vec<String> = recorded.excluded_terms().iter().map(ToString::to_string).collect();
    if !terms.is_empty() {
        notes.push(format!("measured and predicted torques are without {}", terms.join(", ")));
    }
    let missing = model.missing_parameters(cell);
    if !missing.is_empty() {
        notes.push(format!("not in the result, and set to 0: {}", missing.join(", ")));
    }
    if same_configuration == Some(false) {
        notes.push(OTHER_CONFIGURATION.to_owned());
    }
    notes
}

/// Returns a table with a row for each joint and a row for all joints together.
fn text(prediction: &Prediction, cell: &Cell, notes: &[String]) -> String {
    let Prediction { error, quantiles_per_joint, expected_error, .. } = prediction;
    let none = || "–".to_owned();
    let percent = |value: f64| match value.is_nan() {
        true => none(),
        false => format!("{:.2} %", 100.0 * value),
    };
    let mut rows: Vec<Vec<String>> = cell
        .robot
        .chain()
        .iter()
        .enumerate()
        .map(|(joint, described): (usize, &Joint)| {
            let expected_of_joint =
                expected_error.as_ref().map(|of| of.relative_error_per_joint[joint]);
            let torque = |value: f64| match value.is_nan() {
                true => none(),
                false => {
                    format!("{} {}", significant_digits(value, 3), described.kind.torque_unit())
                }
            };
            vec![
                format!("joint {}", cell.robot.joint_label(JointIndex::new(joint))),
                percent(error.relative_error_per_joint[joint]),
                expected_of_joint.map_or("–".to_owned(), percent),
                torque(error.rms_error_per_joint_nm[joint]),
                torque(quantiles_per_joint[joint].of_999),
            ]
        })
        .collect();
    let predicted_error =
        expected_error.as_ref().map_or("–".to_owned(), |of| percent(of.relative_error));
    rows.push(vec![
        "all".to_owned(),
        percent(error.relative_error),
        predicted_error,
        none(),
        none(),
    ]);
    let table = align_table(&["", "error", "expected", "rms error", "99.9 % below"], &rows);
    let ratio = expected_error.as_ref().map(|of| error.relative_error / of.relative_error);
    let ratio = ratio.filter(|ratio| ratio.is_finite()).map(|ratio| {
        format!("the error is {} times the expected one\n", significant_digits(ratio, 2))
    });
    let notes = notes.iter().map(|note| format!("note: {note}\n"));
    core::iter::once(table).chain(ratio).chain(notes).collect()
}
