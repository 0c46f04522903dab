//! `didim identify`: identifies offline, from a table or a log of frames.

use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use didim_identification::identification::{
    Estimate, Identification, IdentificationError, Method, Reduction, UncheckedParameter,
};
use serde::Serialize;

use super::advise::advice_for;
use crate::CliError;
use crate::choices::{choices_text, make_choices};
use crate::input::{Samples, signal_source};
use crate::names::{DEFAULT_CELL, REPORT_FILE, RESULT_FILE, method_parser};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_folder, check_outputs, print, write_figure, write_report, write_text};
use crate::progress::WorkIndicator;
use crate::required_uses::RequiredUses;
use crate::stored_result::{StoredResult, store_result};
use crate::stream::InputFileOrStream;
use crate::terminal::print_for_terminal;
use crate::torque_joints::TorqueJoints;
use didim::analysis::identify::{
    IdentifyError, parameters_of_measurement, reduce_measurements, rms_deviation,
};
use didim::analysis::{
    CountedPiece, DesignedMotion, ExpectedParameter, identify_recordings, measurement_pairs,
};
use didim::archive::store::{Recordings, Timestamp};
use didim::cell::{Cell, SignalSource};
use didim::report::html::{InputFile, Origin, Report, SampleRange};
use didim::report::{self, MissingAdvice, date_text};
use didim::text::align_table;
use didim::window::DriveReadings;
use didim_formats::{Measurement, RecordingStart};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The experiment: a table (CSV, Parquet), or a log (candump, ASC, TRC), an MCAP recording or a
    /// capture of the cell's bus. Give it again for further experiments of the same arm
    #[arg(long, value_name = "FILE", required = true)]
    input: Vec<PathBuf>,
    /// The method; the cell's when left out
    #[arg(long, value_name = "METHOD", value_parser = method_parser())]
    method: Option<Method>,
    #[command(flatten)]
    samples: Samples,
    #[command(flatten)]
    torque_joints: TorqueJoints,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write the result, as `--json` prints it, for `predict`, `advise`, `export` and `payload`
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Store the result in this folder, as the service stores its results, for `history`,
    /// `baseline` and `fleet`
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// Write a figure of measured against predicted torque (SVG)
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// A motion that `didim design` wrote for this recording: compare the standard deviations with
    /// its predictions
    #[arg(long, value_name = "FILE")]
    designed: Option<PathBuf>,
    /// Find the essential parameters among all base parameters, and identify only these
    #[arg(long)]
    essential: bool,
    /// Print the composition of each regrouped parameter
    #[arg(long, conflicts_with = "json")]
    regrouping: bool,
    #[command(flatten)]
    required: RequiredUses,
}

impl Arguments {
    /// Compares the result with the predictions of the motion that was designed for it.
    fn compare_with_design(
        &self,
        designed: Option<DesignedMotion>,
        estimate: &Estimate,
    ) -> Vec<ExpectedParameter> {
        let predicted = designed.map_or_else(Vec::new, |of| of.compare(estimate));
        if let Some(file) = self.designed.as_ref().filter(|_| predicted.is_empty()) {
            let explanation = "it predicts no parameter that is identified here";
            print_note(&format!("note: {}: {explanation}\n", file.display()));
        }
        predicted
    }

    /// Returns the line with the next command: keep the result, or find out what it is missing.
    fn next_command(&self, inputs: &[InputFileOrStream]) -> String {
        if let Some(result) = &self.out {
            return NextCommand::new("advise")
                .with_option("--cell", &self.cell)
                .with_argument(result)
                .to_string();
        }
        if inputs.iter().any(InputFileOrStream::is_stream) {
            return String::new();
        }
        let line = NextCommand::repeated().with_option("--out", RESULT_FILE);
        match self.report {
            Some(_) => line.to_string(),
            None => line.with_option("--report", REPORT_FILE).to_string(),
        }
    }
}

/// Output of `--json`: the estimate, and the run time, which is not in a result file.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    estimate: &'a Estimate,
    #[serde(skip_serializing_if = "Option::is_none")]
    reduction: Option<&'a Reduction>,
    /// Start time of the first recording, if its time stamps contain it.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    /// Additional drive readings in the counted samples; `None` for several recordings.
    #[serde(flatten)]
    readings: Option<&'a DriveReadings>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    recordings: &'a [RecordingLine],
    /// Numbers of frames and bus cycles that are not used, by cause, in all recordings together.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    unused_frames: BTreeMap<&'static str, u64>,
    /// Predictions of the designed motion, compared with the result.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    #[serde(rename = "foretold")]
    predicted: &'a [ExpectedParameter],
    elapsed_ms: f64,
}

/// One of several recordings or pieces: its error with the parameters of all recordings together,
/// and the distance of its separately identified parameters from those of each other recording.
#[derive(Serialize)]
struct RecordingLine {
    input: String,
    /// Start time of the file, if its time stamps contain it.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<RecordingStart>,
    /// Additional drive readings in the counted samples of the recording.
    #[serde(flatten)]
    readings: DriveReadings,
    relative_error: f64,
    /// Root mean square difference to the separately identified parameters of each recording
    /// \[standard deviations\]. `None` (JSON null) for the recording itself, or if one of the two
    /// recordings cannot be identified separately.
    rms_deviation_from: Vec<Option<f64>>,
}

/// Maximum number of recordings or pieces that are compared with each other, because the size of
/// the table grows with the square of this number.
const MAX_COMPARED_RECORDINGS: usize = 12;
const MAX_SEPARATE_IDENTIFICATIONS: RangeInclusive<usize> = 2..=MAX_COMPARED_RECORDINGS;

/// Identifies each recording or piece separately, if there are at least two and at most
/// `MAX_COMPARED_RECORDINGS`.
fn identify_separately(
    cell: &Cell,
    method: Method,
    reported: &[RecordingEntry],
    measurements: &[(&Measurement, Range<usize>)],
    together: &Estimate,
) -> Vec<RecordingLine> {
    if !MAX_SEPARATE_IDENTIFICATIONS.contains(&measurements.len()) {
        return Vec::new();
    }
    let alone: Vec<Option<Vec<UncheckedParameter>>> = (measurements.iter())
        .map(|(measurement, counted)| {
            parameters_of_measurement(cell, method, measurement, counted.clone()).ok()
        })
        .collect();
    let errors = reported.iter().zip(&together.relative_error_per_recording).enumerate();
    errors
        .map(|(index, (piece, relative_error)): (usize, (&RecordingEntry, &f64))| RecordingLine {
            input: piece.name.clone(),
            recorded: piece.recording_start,
            readings: piece.range.readings().clone(),
            relative_error: *relative_error,
            rms_deviation_from: alone
                .iter()
                .enumerate()
                .map(|(other, found): (usize, &Option<Vec<UncheckedParameter>>)| {
                    let [one, other] =
                        [alone[index].as_ref(), found.as_ref().filter(|_| other != index)];
                    one.zip(other).map(|(one, other)| rms_deviation(one, other))
                })
                .collect(),
        })
        .collect()
}

/// Formats a table of the recordings.
fn recordings_table(recordings: &[RecordingLine]) -> String {
    if recordings.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> = (recordings.iter())
        .map(|line| {
            let shown = |value: &Option<f64>| value.map_or("–".to_owned(), |z| format!("{z:.2}"));
            let error = format!("{:.2} %", 100.0 * line.relative_error);
            let deviations = line.rms_deviation_from.iter().map(shown);
            [line.input.clone(), error].into_iter().chain(deviations).collect()
        })
        .collect();
    let numbers: Vec<String> =
        (1..=recordings.len()).map(|number| format!("rms z to {number}")).collect();
    let mut header = vec!["recording", "error"];
    header.extend(numbers.iter().map(String::as_str));
    format!("\n{}", align_table(&header, &rows))
}

/// Data on a piece of a file that are needed after the identification has taken its samples.
struct RecordingEntry {
    /// Index of the file among the inputs.
    input: usize,
    name: String,
    what_counted: String,
    recording_start: Option<RecordingStart>,
    unused_frames: BTreeMap<&'static str, u64>,
    range: SampleRange,
}

impl RecordingEntry {
    fn new(input: usize, path: &Path, piece: &CountedPiece) -> Self {
        let name = path.display().to_string() + &piece.recording_begin();
        let (what_counted, range) = (piece.counted_text(), SampleRange::from_piece(piece));
        let (recording_start, unused_frames) = (piece.recording_start, piece.unused_frames.clone());
        Self { input, name, what_counted, recording_start, unused_frames, range }
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let mut cell = arguments.torque_joints.read_cell(&arguments.cell)?;
    let Arguments { cell: cell_file, input, out, figure, report, .. } = arguments;
    // Outputs are checked first, so that no work is lost.
    let read = input.iter().chain([cell_file, &cell.robot_file]);
    let read: Vec<&Path> = read.map(PathBuf::as_path).collect();
    check_outputs(figure.iter().chain(report).chain(out), &read)?;
    arguments.state.as_deref().map(check_folder).transpose()?;
    let designed = arguments.designed.as_deref().map(DesignedMotion::read);
    let designed = designed.transpose().map_err(CliError::from_failure)?;
    let inputs = input.iter().map(|path| InputFileOrStream::open(path));
    let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
    let (mut parts, reported) = read_recordings(arguments, &cell, &inputs)?;
    let measurements = measurement_pairs(&parts);
    let first = inputs[0].displayed_path();
    let start = Instant::now();
    let choices = make_choices(&mut cell, &measurements, first)?;
    // The choices are printed before the method runs, because the method may fail with them.
    if !arguments.json {
        print(&choices_text(&choices, &cell))?;
    }
    let mut reduction = None;
    if arguments.essential {
        let essential = WorkIndicator::start("finding the essential parameters")
            .show_during(|| reduce_measurements(&cell, &measurements))
            .map_err(|error| CliError::in_file(first, error))?;
        cell = cell.with_parameters(&essential.essential);
        reduction = Some(essential);
    }
    let method = arguments.method.unwrap_or(cell.method);
    let working = WorkIndicator::start(&format!("identifying by {method}"));
    // The measurements are needed again only if each is identified separately.
    let keeps_parts = MAX_SEPARATE_IDENTIFICATIONS.contains(&parts.len());
    let sources: Vec<SignalSource> =
        inputs.iter().map(|input| signal_source(input, &cell)).collect();
    let how = (&choices, &sources[..], keeps_parts);
    let identified =
        working.show_during(|| identify_recordings(&mut cell, method, &mut parts, how));
    let identification =
        identified.map_err(|error| not_identified(error, &arguments.cell, first))?;
    let elapsed = start.elapsed();
    let measurements = measurement_pairs(&parts);
    let together = &identification.estimate;
    let predicted = arguments.compare_with_design(designed, together);
    let recordings = WorkIndicator::start("identifying from each recording alone")
        .show_during(|| identify_separately(&cell, method, &reported, &measurements, together));
    let json = || {
        let reduction = reduction.as_ref();
        json_text(&reported, reduction, &identification, elapsed, &predicted, &recordings)
    };
    if arguments.json {
        print(&json()?)?;
    } else {
        let regrouping = arguments.regrouping;
        print_for_terminal(&text(&cell, reduction.as_ref(), &identification, regrouping))?;
        show_recordings(&inputs, &reported)?;
        print_for_terminal(&recordings_table(&recordings))?;
        if !predicted.is_empty() {
            print_for_terminal(&report::expectation_text(&predicted))?;
        }
    }
    // Files are written after the result, so that a write error does not cost the result.
    if let Some(path) = out {
        write_text(path, &json()?)?;
    }
    let next = write_files(arguments, &cell, &inputs, &reported, (&identification, &predicted))?;
    if !arguments.json {
        print_note(&next);
    }
    arguments.required.check_estimate(&identification.estimate)
}

/// Writes the figure and the report, and stores the result in a history. Returns the line with the
/// next command.
fn write_files(
    arguments: &Arguments,
    cell: &Cell,
    inputs: &[InputFileOrStream],
    reported: &[RecordingEntry],
    (identification, predicted): (&Identification, &[ExpectedParameter]),
) -> Result<String, CliError> {
    if let Some(path) = &arguments.figure {
        write_figure(path, cell, identification)?;
    }
    if arguments.report.is_none() && arguments.state.is_none() {
        return Ok(arguments.next_command(inputs));
    }
    let files: Vec<InputFile> =
        inputs.iter().map(InputFileOrStream::input_file).collect::<Result<_, _>>()?;
    if let Some(path) = &arguments.report {
        store_report(path, cell, &files, reported, (identification, predicted))?;
    }
    let Some(folder) = &arguments.state else { return Ok(arguments.next_command(inputs)) };
    let stored = store_in_history(folder, cell, &files, reported, &identification.estimate)?;
    if !arguments.json {
        print(&stored.message)?;
    }
    Ok(stored.next.to_string())
}

/// Stores the result in a folder of results.
fn store_in_history(
    folder: &Path,
    cell: &Cell,
    files: &[InputFile],
    reported: &[RecordingEntry],
    estimate: &Estimate,
) -> Result<StoredResult, CliError> {
    let ranges = reported.iter().map(|of| (files[of.input].sha256.as_str(), of.range.counted()));
    let recordings = Recordings {
        counted_files: ranges.collect(),
        sample_rate_hz: reported[0].range.rate_hz(),
        recorded: reported.iter().filter_map(|of| of.recording_start).max(),
        readings: match reported {
            [one] => one.range.readings().clone(),
            _ => DriveReadings::default(),
        },
    };
    store_result(folder, cell, estimate, (files, &recordings))
}

/// Adds the path of the cell file to an error in the configuration, and the path of the recording
/// to any other error.
fn not_identified(error: IdentifyError, cell_file: &Path, recording: &Path) -> CliError {
    match error {
        IdentifyError::Identification(IdentificationError::NoController { .. })
        | IdentifyError::NotRobust(_) => {
            CliError::from_configuration(format!("{}: {error}", cell_file.display()))
        }
        error => CliError::in_file(recording, error),
    }
}

/// Reads the recordings of all inputs, each with its entry in the result. A recording that is given
/// again counts once: its noise is the same, so that it says nothing new.
fn read_recordings(
    arguments: &Arguments,
    cell: &Cell,
    inputs: &[InputFileOrStream],
) -> Result<(Vec<CountedPiece>, Vec<RecordingEntry>), CliError> {
    let (mut parts, mut reported): (Vec<CountedPiece>, Vec<RecordingEntry>) = Default::default();
    for (index, input) in inputs.iter().enumerate() {
        for piece in arguments.samples.read(input, cell)? {
            if let Some(same) = parts.iter().position(|earlier| earlier.has_same_signals(&piece)) {
                let (path, earlier) = (input.displayed_path(), reported[same].input);
                let earlier = inputs[earlier].displayed_path();
                tracing::warn!(
                    "{}: the same recording as {}; it counts once",
                    path.display(),
                    earlier.display()
                );
                continue;
            }
            reported.push(RecordingEntry::new(index, input.displayed_path(), &piece));
            parts.push(piece);
        }
    }
    Ok((parts, reported))
}

/// Returns the result as one line with a JSON object.
fn json_text(
    reported: &[RecordingEntry],
    reduction: Option<&Reduction>,
    identification: &Identification,
    elapsed: Duration,
    predicted: &[ExpectedParameter],
    recordings: &[RecordingLine],
) -> Result<String, CliError> {
    let estimate = &identification.estimate;
    let elapsed_ms = elapsed.as_secs_f64() * 1e3;
    let recorded = reported.first().and_then(|first| first.recording_start);
    let readings = reported.first().filter(|_| reported.len() == 1).map(|one| one.range.readings());
    let mut unused_frames: BTreeMap<&'static str, u64> = BTreeMap::new();
    for (cause, count) in reported.iter().flat_map(|piece| &piece.unused_frames) {
        *unused_frames.entry(cause).or_default() += count;
    }
    let output = Output {
        estimate,
        reduction,
        recorded,
        readings,
        recordings,
        unused_frames,
        predicted,
        elapsed_ms,
    };
    let json = serde_json::to_string(&output).map_err(CliError::from_failure)?;
    Ok(format!("{json}\n"))
}

/// Prints the start time, the samples that count and the drive readings of each recording.
fn show_recordings(
    inputs: &[InputFileOrStream],
    reported: &[RecordingEntry],
) -> Result<(), CliError> {
    let mut last = None;
    for piece in reported.iter().take(MAX_COMPARED_RECORDINGS) {
        if last.replace(piece.input) != Some(piece.input) {
            let written = Timestamp::of_file(inputs[piece.input].path()).ok();
            let written = written.filter(|_| !inputs[piece.input].is_stream());
            let date = date_text(piece.recording_start, written);
            print_for_terminal(&format!("recorded: {date}\n"))?;
        }
        print_for_terminal(&piece.what_counted)?;
        for (name, text) in piece.range.readings().lines() {
            print_for_terminal(&format!("{name}: {text}\n"))?;
        }
    }
    if reported.len() > MAX_COMPARED_RECORDINGS {
        print(&format!("and {} more pieces\n", reported.len() - MAX_COMPARED_RECORDINGS))?;
    }
    Ok(())
}

/// Writes the report of an identification as HTML, with the provenance of each recording.
fn store_report(
    path: &Path,
    cell: &Cell,
    files: &[InputFile],
    reported: &[RecordingEntry],
    (identification, predicted): (&Identification, &[ExpectedParameter]),
) -> Result<(), CliError> {
    let origin = |piece: &RecordingEntry| (files[piece.input].clone(), piece.range.clone());
    let mut origins: Vec<_> = reported.iter().map(origin).collect();
    let (input, samples) = origins.remove(0);
    let origin = Origin { input: Some(input), samples, further_files: origins, note: None };
    let advice = &WorkIndicator::start("trying motions")
        .show_during(|| advice_for(cell, &identification.estimate))
        .unwrap_or_else(|error| {
            MissingAdvice::from_problem(format!("no motion was tried: {error}"))
        });
    let report = Report {
        expectation: predicted,
        advice: Some(advice),
        ..Report::new(cell, identification, &origin)
    };
    write_report(path, &report)
}

fn text(
    cell: &Cell,
    reduction: Option<&Reduction>,
    identification: &Identification,
    regrouping: bool,
) -> String {
    let estimate = &identification.estimate;
    let mut text = reduction.map_or_else(String::new, |reduction| {
        format!("{}\n", report::reduction::reduction_text(reduction))
    });
    text += &report::estimate::parameter_table(estimate);
    text += "\n";
    text += &report::estimate::summary(estimate, &cell.robot);
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
