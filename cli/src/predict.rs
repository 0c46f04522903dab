//! `didim predict`: a stored result on another recording, nothing fitted.

use std::path::{Path, PathBuf};

use clap::Args;
use didim_core::identification::Prediction;
use didim_core::robot::Joint;
use serde::Serialize;

use super::CliError;
use super::input::{Samples, pairs};
use super::names::DEFAULT_CELL;
use super::output::{check_outputs, print, write_text};
use super::progress::Working;
use super::stream::Input;
use super::terminal::show;
use didim::cell::Cell;
use didim::offline::{OTHER_CONFIGURATION, StoredModel};
use didim::report::html::{InputFile, PredictionReport};
use didim::text::{aligned, significant};
use didim_formats::RecordingStart;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The result: a file that the service stored, or what `didim identify --json` printed
    #[arg(long, value_name = "FILE")]
    result: PathBuf,
    /// The recording: a table (CSV, Parquet), or a candump log or an MCAP recording of the cell's bus
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    #[command(flatten)]
    samples: Samples,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    prediction: &'a Prediction,
    /// When the recording began, where its stamps say so.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    /// Whether the result was identified with this configuration; nothing where it does not say.
    same_configuration: Option<bool>,
    /// What must be known with it.
    notes: &'a [String],
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::configuration)?;
    // Before the work that would be lost.
    let read: [&Path; 4] = [&arguments.cell, &arguments.result, &arguments.input, &cell.robot_file];
    check_outputs(&arguments.report, &read)?;
    let (model, cell) = StoredModel::read(&arguments.result, cell).map_err(CliError::failed)?;
    let input = Input::open(&arguments.input)?;
    let pieces = arguments.samples.read(&input, &cell)?;
    let recorded = pieces.first().and_then(|first| first.recorded);
    let prediction = Working::on("predicting")
        .during(|| model.predict(&cell, &pairs(&pieces)))
        .map_err(|error| CliError::in_file(input.shown(), error))?;
    if !prediction.error.relative_error.is_finite() {
        let what = "no finite torque comes of its parameters; give the result as it was stored";
        return Err(CliError::in_file(&arguments.result, what));
    }
    let same_configuration = model.is_of(&cell);
    let notes = notes(&model, &cell, &prediction, same_configuration);
    if arguments.json {
        let output =
            Output { prediction: &prediction, recorded, same_configuration, notes: &notes };
        let json = serde_json::to_string(&output).map_err(CliError::failed)?;
        print(&format!("{json}\n"))?;
    } else {
        show(&text(&prediction, &cell, &notes))?;
    }
    let Some(path) = &arguments.report else { return Ok(()) };
    let read = |path| InputFile::read(path).map_err(|error| CliError::in_file(path, error));
    let (result, input) = (read(&arguments.result)?, input.provenance()?);
    let report = PredictionReport {
        cell: &cell,
        result: &result,
        input: &input,
        recorded,
        prediction: &prediction,
        notes: &notes,
    };
    write_text(path, &report.to_html())
}

/// What must be known with a prediction.
fn notes(
    model: &StoredModel,
    cell: &Cell,
    prediction: &Prediction,
    same_configuration: Option<bool>,
) -> Vec<String> {
    let mut notes = Vec::new();
    if prediction.foretold.is_none() {
        notes.push(
            "the result does not say what error to expect: it is of an earlier version, of other \
             parameters or filters, or was changed"
                .to_owned(),
        );
    }
    let missing = model.missing(cell);
    if !missing.is_empty() {
        notes.push(format!("not in the result, and taken as 0: {}", missing.join(", ")));
    }
    if same_configuration == Some(false) {
        notes.push(OTHER_CONFIGURATION.to_owned());
    }
    notes
}

/// A table by joints, and the whole.
fn text(prediction: &Prediction, cell: &Cell, notes: &[String]) -> String {
    let Prediction { error, quantiles_per_joint, foretold, .. } = prediction;
    let percent = |value: f64| format!("{:.2} %", 100.0 * value);
    let of_joint = |(joint, described): (usize, &Joint)| {
        let foretold = foretold.as_ref().map(|of| of.relative_error_per_joint[joint]);
        let torque =
            |value: f64| format!("{} {}", significant(value, 3), described.kind.torque_unit());
        vec![
            format!("joint {}", joint + 1),
            percent(error.relative_error_per_joint[joint]),
            foretold.map_or("–".to_owned(), percent),
            torque(error.rms_error_per_joint_nm[joint]),
            torque(quantiles_per_joint[joint].of_999),
        ]
    };
    let mut rows: Vec<Vec<String>> = cell.robot.chain().iter().enumerate().map(of_joint).collect();
    let whole = foretold.as_ref().map_or("–".to_owned(), |of| percent(of.relative_error));
    let none = || "–".to_owned();
    rows.push(vec!["all".to_owned(), percent(error.relative_error), whole, none(), none()]);
    let table = aligned(&["", "error", "foretold", "rms error", "99.9 % below"], &rows);
    let notes = notes.iter().map(|note| format!("note: {note}\n"));
    core::iter::once(table).chain(notes).collect()
}
