//! `didim predict`: a stored result on another recording, nothing fitted.

use std::path::PathBuf;

use clap::Args;
use didim_core::identification::PredictionError;
use serde::Serialize;

use super::CliError;
use super::identify::Samples;
use super::output::print;
use didim::cell::Cell;
use didim::offline::predict::{Foretold, StoredModel};
use didim::text::{aligned, significant};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE")]
    cell: PathBuf,
    /// The result: a file that the service stored, or what `didim identify --json` printed
    #[arg(long, value_name = "FILE")]
    result: PathBuf,
    /// The recording: a CSV file, or a candump log or an MCAP recording of the cell's bus
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    #[command(flatten)]
    samples: Samples,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    error: &'a PredictionError,
    foretold: Option<&'a Foretold>,
    /// Whether the result was identified with this configuration; nothing where it does not say.
    same_configuration: Option<bool>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::configuration)?;
    let model = StoredModel::read(&arguments.result, &cell).map_err(CliError::failed)?;
    let (measurement, counted) = arguments.samples.read(&arguments.input, &cell)?;
    let error = model
        .predict(&cell, &measurement, counted)
        .map_err(|error| CliError::in_file(&arguments.input, error))?;
    let same_configuration =
        model.configuration.as_ref().map(|hash| *hash == cell.configuration_sha256);
    let foretold = model.foretold.as_ref();
    if arguments.json {
        let output = Output { error: &error, foretold, same_configuration };
        let json = serde_json::to_string(&output).map_err(CliError::failed)?;
        return print(&format!("{json}\n"));
    }
    print(&text(&error, foretold, same_configuration))
}

/// A table by joints, and the whole.
fn text(
    error: &PredictionError,
    foretold: Option<&Foretold>,
    same_configuration: Option<bool>,
) -> String {
    let percent = |value: f64| format!("{:.2} %", 100.0 * value);
    let of_joint = |joint: usize| {
        let per_joint = foretold.map(|foretold| &foretold.relative_error_per_joint);
        let foretold = per_joint.and_then(|of| of.get(joint).copied());
        vec![
            format!("joint {}", joint + 1),
            percent(error.relative_error_per_joint[joint]),
            significant(error.rms_error_per_joint_nm[joint], 3),
            foretold.map_or("–".to_owned(), percent),
        ]
    };
    let mut rows: Vec<Vec<String>> =
        (0..error.relative_error_per_joint.len()).map(of_joint).collect();
    let whole = foretold.map_or("–".to_owned(), |foretold| percent(foretold.relative_error));
    rows.push(vec!["all".to_owned(), percent(error.relative_error), "–".to_owned(), whole]);
    let mut text = aligned(&["", "error", "rms [N·m]", "foretold elsewhere"], &rows);
    if same_configuration == Some(false) {
        text += "note: the result was identified with another configuration\n";
    }
    text
}
