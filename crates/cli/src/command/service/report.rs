//! `didim report`: writes the report of a stored result.

use std::path::{Path, PathBuf};

use clap::Args;
use didim_identification::identification::{Fit, Identification};
use serde::Serialize;

use super::replay::replay_recording;
use crate::CliError;
use crate::names::DEFAULT_CELL;
use crate::output::{check_outputs, print, print_json, write_report};
use crate::stream::InputFileOrStream;
use didim::analysis::OTHER_CONFIGURATION;
use didim::archive::drift::DriftStatus;
use didim::archive::drift_of_result;
use didim::archive::store::{HistoryLine, ResultRecord, for_each_line, result_file};
use didim::cell::Cell;
use didim::files::read_bytes;
use didim::live::recording::kept_result;
use didim::report::html::{Origin, Report, SampleRange};
use didim::window::Note;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Number of the result, as `didim history` shows it
    result: u64,
    /// The cell file of the service
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The folder of its results [default: the cell's]
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// The report [default: `result-00000042.html` in this folder, for result 42]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the result with its comparison with the baseline as one JSON object, and write no
    /// report
    #[arg(long, conflicts_with = "out")]
    json: bool,
}

/// Output of `--json`: the stored result, and what the history knows about it.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    record: &'a ResultRecord,
    /// Note on the window.
    #[serde(skip_serializing_if = "Option::is_none")]
    note: Option<&'a Note>,
    /// Comparison with the baseline and the raised alarms. `None` without a baseline, and for
    /// results before it.
    drift: Option<&'a DriftStatus>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::from_configuration)?;
    let folder = arguments.state.as_ref().unwrap_or(&cell.service.state_directory);
    let number = arguments.result;
    let file = result_file(folder, number);
    let out = arguments.out.clone().unwrap_or_else(|| default_name(&file));
    if !arguments.json {
        check_outputs([&out], &[&arguments.cell, &file, &cell.robot_file])?;
    }
    let mut record = read_record(&file)?;
    let line = history_line(folder, number)?;
    let drift = line.as_ref().map(|line| drift_of_result(folder, line, cell.service.drift));
    let drift = drift.transpose().map_err(CliError::from_failure)?.flatten();
    if arguments.json {
        let note = line.as_ref().and_then(|line| line.note.as_ref());
        return print_json(&Output { record: &record, note, drift: drift.as_ref() });
    }
    // JSON has it in the name alone.
    for parameter in &mut record.estimate.parameters {
        parameter.regrouped = parameter.name.ends_with('r');
    }
    let is_of_cell = record.configuration == cell.configuration_sha256;
    if !is_of_cell {
        tracing::warn!("{}: {OTHER_CONFIGURATION}", file.display());
    }
    let recordings = cell.service.recordings.clone().unwrap_or_default().folder(folder);
    let recording = kept_result(&recordings, number);
    let reproduced = match recording.filter(|_| is_of_cell) {
        Some(recording) => reproduce(&cell, &recording, &record)?,
        None => None,
    };
    let has_curves = reproduced.is_some();
    let stored = || Identification { estimate: record.estimate.clone(), fit: Fit::default() };
    let identification = reproduced.unwrap_or_else(stored);
    let origin = Origin {
        input: None,
        samples: SampleRange::Window(record.window.clone()),
        further_files: Vec::new(),
        note: line.and_then(|line| line.note),
    };
    let report = Report::new(&cell, &identification, &origin);
    write_report(&out, &Report { drift: drift.as_ref(), ..report })?;
    let curves = if has_curves { "" } else { " without curves: its recording is not kept" };
    print(&format!("{}: the report of result {number}{curves}\n", out.display()))
}

fn read_record(file: &Path) -> Result<ResultRecord, CliError> {
    let bytes = read_bytes(file).map_err(|error| CliError::in_file(file, error))?;
    serde_json::from_slice(&bytes).map_err(|error| CliError::in_file(file, error))
}

fn default_name(result: &Path) -> PathBuf {
    PathBuf::from(result.file_name().unwrap_or_default()).with_extension("html")
}

/// Identifies a kept recording again. `None` if that does not give the stored result, such as with
/// another version of the program.
fn reproduce(
    cell: &Cell,
    recording: &Path,
    record: &ResultRecord,
) -> Result<Option<Identification>, CliError> {
    let input = InputFileOrStream::open(recording)?;
    let identification = replay_recording(cell, &input, &[], None)?.1.identification;
    let (found, stored) = (&identification.estimate.parameters, &record.estimate.parameters);
    // The last digit may differ after reading.
    let is_same = found.len() == stored.len()
        && found.iter().zip(stored).all(|(found, stored)| {
            let rounded = |value: f64| format!("{value:.9e}");
            found.name == stored.name && rounded(found.value) == rounded(stored.value)
        });
    if !is_same {
        tracing::warn!("{}: it gives another result, and is not shown", recording.display());
    }
    Ok(is_same.then_some(identification))
}

/// Returns the newest line of a result in the history, if it has one of its own.
fn history_line(folder: &Path, number: u64) -> Result<Option<HistoryLine>, CliError> {
    let mut found = None;
    let read = for_each_line(folder, |line| {
        if line.result == number && line.day.is_none() {
            found = Some(line);
        }
    });
    read.map_err(CliError::from_failure)?;
    Ok(found)
}
