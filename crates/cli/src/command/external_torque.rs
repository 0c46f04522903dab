//! `didim external-torque`: the torque that drives and model do not explain, along a recording.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use didim_identification::external_torque::{ObserverError, ObserverState};
use didim_identification::identification::Use;
use serde::Serialize;

use crate::CliError;
use crate::input::{Samples, parse_positive};
use crate::names::DEFAULT_CELL;
use crate::output::{check_outputs, print, print_json, write_text, write_whole};
use crate::progress::WorkIndicator;
use crate::stream::InputFileOrStream;
use crate::terminal::print_for_terminal;
use didim::analysis::{
    CountedPiece, ExternalTorqueRow, ExternalTorqueSummary, OTHER_CONFIGURATION, StoredModel,
};
use didim::cell::Cell;
use didim::report::ExternalTorqueFigure;
use didim::text::{align_table, significant_digits, to_uncertainty};

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
    /// Bandwidth [Hz]; without it `contact.bandwidth_hz` of the cell, or the band of the
    /// identification
    #[arg(long, value_name = "HZ", value_parser = parse_positive, allow_negative_numbers = true)]
    bandwidth: Option<f64>,
    /// Write a table (CSV): torque and standard deviation of each joint at each sample
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the torque of each joint over time (one SVG file)
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    summary: &'a ExternalTorqueSummary,
    /// Caveats for the reader.
    notes: &'a [String],
}

/// Error while rows are written.
enum RowError {
    Observer(ObserverError),
    Write(CliError),
}

impl From<ObserverError> for RowError {
    fn from(error: ObserverError) -> Self {
        Self::Observer(error)
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::from_configuration)?;
    let read: [&Path; 4] = [&arguments.cell, &arguments.result, &arguments.input, &cell.robot_file];
    check_outputs(arguments.out.iter().chain(&arguments.figure), &read)?;
    let (model, cell) =
        StoredModel::read_stored_model(&arguments.result, cell).map_err(CliError::from_failure)?;
    let input = InputFileOrStream::open(&arguments.input)?;
    let parts = arguments.samples.read(&input, &cell)?;
    let configured = cell.contact.as_ref().and_then(|contact| contact.bandwidth_hz);
    let samples = parts.iter().map(|part| part.counted_range.len()).sum();
    let mut figure = ExternalTorqueFigure::new(samples, cell.robot.joints());
    let observed = Observed {
        model: &model,
        cell: &cell,
        parts: &parts,
        bandwidth_hz: arguments.bandwidth.or(configured),
    };
    let indicator = WorkIndicator::start("observing");
    let summary = indicator.show_during(|| observed.run(arguments.out.as_deref(), &mut figure));
    let summary = summary.map_err(|error| match error {
        RowError::Observer(error) => CliError::in_file(&arguments.result, error),
        RowError::Write(error) => error,
    })?;
    if let Some(path) = &arguments.figure {
        let file = input.displayed_path().file_name().unwrap_or_default();
        let heading = format!("{}: external torque in {}", cell.name, file.display());
        write_text(path, &figure.to_svg(&heading, &cell.robot))?;
    }
    let notes = notes(&model, &cell, &summary);
    if arguments.json {
        return print_json(&Output { summary: &summary, notes: &notes });
    }
    print_for_terminal(&text(&summary, &notes))?;
    match &arguments.out {
        Some(path) => print(&format!("written to {}\n", path.display())),
        None => Ok(()),
    }
}

/// A recording under the observer of a model.
struct Observed<'a> {
    model: &'a StoredModel,
    cell: &'a Cell,
    parts: &'a [CountedPiece],
    bandwidth_hz: Option<f64>,
}

impl Observed<'_> {
    /// Observes the recording, and writes every row to a table if one is wanted.
    fn run(
        &self,
        table: Option<&Path>,
        figure: &mut ExternalTorqueFigure,
    ) -> Result<ExternalTorqueSummary, RowError> {
        let Self { model, cell, parts, bandwidth_hz } = *self;
        let Some(path) = table else {
            return model.external_torque(cell, parts, bandwidth_hz, |row| {
                figure.add(row);
                Ok(())
            });
        };
        let mut outcome = None;
        let written = write_whole(path, |out| {
            let failed = |error: io::Error| CliError::in_file(path, error);
            let mut out = BufWriter::new(out);
            let joints = cell.robot.joints();
            writeln!(out, "{}", header(cell).join(",")).map_err(failed)?;
            let observed = model.external_torque(cell, parts, bandwidth_hz, |row| {
                figure.add(row);
                let written = writeln!(out, "{}", record(row, joints).join(","));
                written.map_err(|error| RowError::Write(failed(error)))
            });
            out.flush().map_err(failed)?;
            match observed {
                Err(RowError::Write(error)) => return Err(error),
                other => outcome = Some(other),
            }
            Ok(())
        });
        match outcome {
            Some(observed) if written.is_ok() => observed,
            _ => Err(RowError::Write(
                written
                    .err()
                    .unwrap_or_else(|| CliError::in_file(path, "no row was written; report this")),
            )),
        }
    }
}

/// Returns the names of the columns: units are those of the joints.
fn header(cell: &Cell) -> Vec<String> {
    let mut names = vec!["time_s".to_owned(), "usable".to_owned()];
    for quantity in ["external_torque", "standard_deviation"] {
        names.extend((1..).zip(cell.robot.chain()).map(|(number, joint)| {
            let unit = if joint.kind.torque_unit() == "N" { "n" } else { "nm" };
            format!("{quantity}_{unit}_{number}")
        }));
    }
    names
}

/// Returns the cells of a row. A joint without a recorded torque has empty cells.
fn record(row: &ExternalTorqueRow, joints: usize) -> Vec<String> {
    let estimate = &row.estimate;
    let usable = u8::from(estimate.state == ObserverState::Settled);
    let begin = vec![row.time_s.to_string(), usable.to_string()];
    let values = [&estimate.torque, &estimate.standard_deviation].map(|of| &of[..joints]);
    begin.into_iter().chain(values.concat().iter().map(number_cell)).collect()
}

/// Returns the cell of a number; an empty one for NaN.
fn number_cell(value: &f64) -> String {
    if value.is_nan() { String::new() } else { value.to_string() }
}

/// Returns the caveats of the estimates.
fn notes(model: &StoredModel, cell: &Cell, summary: &ExternalTorqueSummary) -> Vec<String> {
    let mut notes = model.refusals(&[Use::Prediction]);
    let missing = model.missing_parameters(cell);
    if !missing.is_empty() {
        notes.push(format!("not in the result, and set to 0: {}", missing.join(", ")));
    }
    if model.is_of(cell) == Some(false) {
        notes.push(OTHER_CONFIGURATION.to_owned());
    }
    let ExternalTorqueSummary { samples, outside_motion, .. } = summary;
    if *outside_motion > 0 {
        notes.push(format!(
            "{outside_motion} of {} samples are outside the positions or speeds of the \
             identification, and do not count",
            samples + outside_motion
        ));
    }
    if *samples == 0 {
        notes.push(
            "no sample has a usable estimate; identify with a motion that reaches these positions \
             and speeds"
                .to_owned(),
        );
    }
    notes
}

/// Returns a table with a row for each joint.
fn text(summary: &ExternalTorqueSummary, notes: &[String]) -> String {
    let rows: Vec<Vec<String>> = summary
        .joints
        .iter()
        .map(|joint| {
            let with_unit = |value: f64| format!("{} {}", significant_digits(value, 3), joint.unit);
            let name = joint.joint_name.as_ref().map_or_else(String::new, |of| format!(" ({of})"));
            vec![
                format!("joint {}{name}", joint.joint),
                with_unit(joint.rms),
                with_unit(joint.standard_deviation),
                format!(
                    "{} {}",
                    to_uncertainty(joint.at_largest, joint.standard_deviation_at_largest, 2),
                    joint.unit
                ),
                format!("{} σ", significant_digits(joint.largest_ratio, 2)),
                format!("{:.3} s", joint.at_s),
            ]
        })
        .collect();
    let table = align_table(&["", "rms", "expected (σ)", "largest", "", "at"], &rows);
    let band = format!(
        "external torque in a band of {} Hz, {} samples\n",
        significant_digits(summary.bandwidth_hz, 3),
        summary.samples
    );
    let notes = notes.iter().map(|note| format!("note: {note}\n"));
    [band, table].into_iter().chain(notes).collect()
}
