//! `didim identify`: offline, on a table or a log of frames.

use std::borrow::Cow;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use didim_core::identification::{
    Estimate, Identification, IdentificationError, Method, Reduction,
};
use serde::Serialize;

use super::CliError;
use super::advise::advice_for;
use super::choices::Choices;
use super::input::{Counted, Samples, pairs};
use super::names::{DEFAULT_CELL, methods};
use super::output::{check_outputs, print, write_figure, write_report};
use super::progress::Working;
use super::stream::Input;
use super::tell::tell;
use super::terminal::show;
use didim::cell::Cell;
use didim::offline::identify::{
    IdentifyError, identify_measurement, identify_measurements, law_of_commands,
    reduce_measurements, rms_deviation,
};
use didim::offline::{DesignedMotion, Foretold};
use didim::report;
use didim::report::html::{Origin, Report, SampleRange};
use didim::text::aligned;
use didim::window::DriveReadings;
use didim_formats::{Measurement, RecordingStart};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The experiment: a table (CSV, Parquet), or a log (candump, ASC, TRC), an MCAP recording or a capture of the cell's bus; given again,
    /// further ones of the same arm, for one identification
    #[arg(long, value_name = "FILE", required = true)]
    input: Vec<PathBuf>,
    /// The method; the cell's when left out
    #[arg(long, value_name = "METHOD", value_parser = methods())]
    method: Option<Method>,
    #[command(flatten)]
    samples: Samples,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write a figure of measured against predicted torque (SVG)
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// A motion that `didim design` wrote for this recording: hold the standard deviations against those that it foretells
    #[arg(long, value_name = "FILE")]
    designed: Option<PathBuf>,
    /// Find the essential parameters among all base parameters, and identify these
    #[arg(long)]
    essential: bool,
    /// Print the composition of each regrouped parameter
    #[arg(long, conflicts_with = "json")]
    regrouping: bool,
}

/// What `--json` prints: the estimate, and the run time, which is no part of a result file.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    estimate: &'a Estimate,
    #[serde(skip_serializing_if = "Option::is_none")]
    reduction: Option<&'a Reduction>,
    /// When the first recording began, where its stamps say so.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    /// What the drives told besides along the samples that count, of one recording.
    #[serde(flatten)]
    readings: Option<&'a DriveReadings>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    recordings: &'a [RecordingLine],
    /// What the motion was foretold to tell, beside what came of it.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    foretold: &'a [Foretold],
    elapsed_ms: f64,
}

/// One of several recordings or pieces of them: how well the parameters of all fit it, and how far its own are from those of
/// the others.
#[derive(Serialize)]
struct RecordingLine {
    input: String,
    /// When the file that it is of began, where its stamps say so.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    /// What the drives told besides along its samples that count.
    #[serde(flatten)]
    readings: DriveReadings,
    relative_error: f64,
    /// Root mean square of the differences to the parameters of each other recording, in standard deviations;
    /// nothing where one of the two cannot be identified alone.
    rms_deviation_from: Vec<Option<f64>>,
}

/// So many recordings or pieces are held against each other at most: the table is square.
const COMPARED: usize = 12;
const IDENTIFIED_ALONE: RangeInclusive<usize> = 2..=COMPARED;

/// Every recording, or whole piece of one, by itself, where there are several.
fn recordings(
    cell: &Cell,
    method: Method,
    told: &[Told],
    measurements: &[(&Measurement, Range<usize>)],
    together: &Estimate,
) -> Vec<RecordingLine> {
    if !IDENTIFIED_ALONE.contains(&measurements.len()) {
        return Vec::new();
    }
    let alone: Vec<Option<Estimate>> = (measurements.iter())
        .map(|(measurement, counted)| {
            let found = identify_measurement(cell, method, measurement, counted.clone());
            found.ok().map(|found| found.estimate)
        })
        .collect();
    let told = told.iter().zip(&together.relative_error_per_recording).enumerate();
    let line = |(index, (piece, relative_error)): (usize, (&Told, &f64))| {
        let from = |(other, found): (usize, &Option<Estimate>)| {
            let [one, other] = [alone[index].as_ref(), found.as_ref().filter(|_| other != index)];
            one.zip(other).map(|(one, other)| rms_deviation(one, other))
        };
        RecordingLine {
            input: piece.name.clone(),
            recorded: piece.recorded,
            readings: piece.range.readings().clone(),
            relative_error: *relative_error,
            rms_deviation_from: alone.iter().enumerate().map(from).collect(),
        }
    };
    told.map(line).collect()
}

/// A table of the recordings.
fn compared(recordings: &[RecordingLine]) -> String {
    if recordings.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> = (recordings.iter())
        .map(|line| {
            let shown = |value: &Option<f64>| value.map_or("–".to_owned(), |z| format!("{z:.2}"));
            let error = format!("{:.2} %", 100.0 * line.relative_error);
            let from = line.rms_deviation_from.iter().map(shown);
            [line.input.clone(), error].into_iter().chain(from).collect()
        })
        .collect();
    let numbers: Vec<String> =
        (1..=recordings.len()).map(|number| format!("rms z to {number}")).collect();
    let mut header = vec!["recording", "error"];
    header.extend(numbers.iter().map(String::as_str));
    format!("\n{}", aligned(&header, &rows))
}

/// What is told of a piece of a file after its samples were given away.
struct Told {
    /// The number of the file among the inputs.
    input: usize,
    name: String,
    what_counted: String,
    recorded: Option<RecordingStart>,
    range: SampleRange,
}

impl Told {
    fn of(input: usize, path: &Path, piece: &Counted) -> Self {
        let name = path.display().to_string() + &piece.begin();
        let (what_counted, range) = (piece.what_counted(), piece.range());
        Self { input, name, what_counted, recorded: piece.recorded, range }
    }
}

/// The measurements. They are given away where none is identified alone: nothing of them is wanted again.
fn given(pieces: &mut Vec<Counted>) -> Vec<(Cow<'_, Measurement>, Range<usize>)> {
    if !IDENTIFIED_ALONE.contains(&pieces.len()) {
        let all = pieces.drain(..);
        return all.map(|of| (Cow::Owned(of.piece.measurement), of.counted)).collect();
    }
    pieces.iter().map(|of| (Cow::Borrowed(&of.piece.measurement), of.counted.clone())).collect()
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let mut cell = Cell::read(&arguments.cell).map_err(CliError::configuration)?;
    let Arguments { cell: cell_file, input, figure, report, .. } = arguments;
    // Before the work that would be lost.
    let read = input.iter().chain([cell_file, &cell.robot_file]);
    let read: Vec<&Path> = read.map(PathBuf::as_path).collect();
    check_outputs(figure.iter().chain(report), &read)?;
    let designed = arguments.designed.as_deref().map(DesignedMotion::read);
    let designed = designed.transpose().map_err(CliError::failed)?;
    let inputs =
        arguments.input.iter().map(|path| Input::open(path)).collect::<Result<Vec<_>, _>>()?;
    let (mut pieces, mut told) = (Vec::new(), Vec::new());
    for (index, input) in inputs.iter().enumerate() {
        let of_file = arguments.samples.read(input, &cell)?;
        told.extend(of_file.iter().map(|piece| Told::of(index, input.shown(), piece)));
        pieces.extend(of_file);
    }
    let measurements = pairs(&pieces);
    let first = inputs[0].shown();
    let start = Instant::now();
    let choices = Choices::make(&mut cell, &measurements, first)?;
    // Before the method, which may fail with what was chosen.
    if !arguments.json {
        print(&choices.text(&cell))?;
    }
    let mut reduction = None;
    if arguments.essential {
        let found = Working::on("finding the essential parameters")
            .during(|| reduce_measurements(&cell, &measurements))
            .map_err(|error| CliError::in_file(first, error))?;
        cell = cell.with_parameters(&found.essential);
        reduction = Some(found);
    }
    let method = arguments.method.unwrap_or(cell.method);
    let records = pieces.iter().zip(&told);
    let records =
        records.map(|(of, told)| (&of.piece.measurement, &of.counted, told.range.readings()));
    let law = law_of_commands(&cell, method, records);
    if let Some(law) = law.map_err(|error| CliError::in_file(first, error))? {
        cell.options.controller = Some(law);
    }
    let working = Working::on(&format!("identifying by {method}"));
    let identified = working.during(|| identify_measurements(&cell, method, given(&mut pieces)));
    let mut identification = identified.map_err(|error| match error {
        IdentifyError::Identification(IdentificationError::NoController { .. })
        | IdentifyError::NotRobust(_) => {
            CliError::configuration(format!("{}: {error}", arguments.cell.display()))
        }
        error => CliError::in_file(first, error),
    })?;
    let elapsed = start.elapsed();
    choices.note_in(&mut identification.estimate);
    let measurements = pairs(&pieces);
    let together = &identification.estimate;
    let foretold = designed.map_or_else(Vec::new, |of| of.beside(together));
    if let Some(file) = arguments.designed.as_ref().filter(|_| foretold.is_empty()) {
        let what = "it foretells no parameter that is identified here";
        tell(&format!("note: {}: {what}\n", file.display()));
    }
    let recordings = Working::on("identifying from each recording alone")
        .during(|| recordings(&cell, method, &told, &measurements, together));
    if arguments.json {
        let (estimate, reduction) = (&identification.estimate, reduction.as_ref());
        let elapsed_ms = elapsed.as_secs_f64() * 1e3;
        let recorded = told.first().and_then(|first| first.recorded);
        let readings = told.first().filter(|_| told.len() == 1).map(|one| one.range.readings());
        let recordings = &recordings;
        let foretold = &foretold;
        let output =
            Output { estimate, reduction, recorded, readings, recordings, foretold, elapsed_ms };
        let json = serde_json::to_string(&output).map_err(CliError::failed)?;
        print(&format!("{json}\n"))?;
    } else {
        if let Some(reduction) = &reduction {
            show(&format!("{}\n", report::reduction::sequence(reduction)))?;
        }
        show(&text(&cell, &identification, arguments.regrouping))?;
        let mut last = None;
        for piece in told.iter().take(COMPARED) {
            if last.replace(piece.input) != Some(piece.input) {
                print(&format!("recorded: {}\n", RecordingStart::shown(piece.recorded)))?;
            }
            show(&piece.what_counted)?;
            for (name, text) in piece.range.readings().lines() {
                show(&format!("{name}: {text}\n"))?;
            }
        }
        if told.len() > COMPARED {
            print(&format!("and {} more pieces\n", told.len() - COMPARED))?;
        }
        show(&compared(&recordings))?;
        if !foretold.is_empty() {
            show(&report::foretold_text(&foretold))?;
        }
    }
    // After the result, which a file that cannot be written must not cost.
    if let Some(path) = &arguments.figure {
        write_figure(path, &cell, &identification)?;
    }
    if let Some(path) = &arguments.report {
        let mut origins = Vec::with_capacity(told.len());
        for (index, input) in inputs.iter().enumerate() {
            let input = input.provenance()?;
            let own = told.iter().filter(|piece| piece.input == index);
            origins.extend(own.map(|piece| (input.clone(), piece.range.clone())));
        }
        let (input, samples) = origins.remove(0);
        let origin = Origin { input: Some(input), samples, further: origins, note: None };
        let advice = &Working::on("trying motions")
            .during(|| advice_for(&cell, &identification.estimate))
            .unwrap_or_else(|error| format!("no motion was tried: {error}"));
        let report =
            Report { foretold: &foretold, advice, ..Report::new(&cell, &identification, &origin) };
        write_report(path, &report)?;
    }
    Ok(())
}

fn text(cell: &Cell, identification: &Identification, regrouping: bool) -> String {
    let estimate = &identification.estimate;
    let mut text = report::estimate::parameter_table(estimate);
    text += "\n";
    text += &report::estimate::summary(estimate);
    if regrouping {
        text += "\nregrouping:\n";
        for parameter in &estimate.parameters {
            if let Some(expression) = cell.base.expression(&parameter.name) {
                text += &format!("  {} = {expression}\n", parameter.name);
            }
        }
    }
    text
}
