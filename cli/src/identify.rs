//! `didim identify`: offline, on a CSV experiment or a candump log.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use didim_core::identification::{
    Estimate, Identification, IdentificationError, Method, Reduction,
};
use serde::Serialize;

use super::CliError;
use super::choices::Choices;
use super::output::{print, write_figure, write_report};
use didim::cell::Cell;
use didim::offline::identify::{
    IdentifyError, identify_measurement, identify_measurements, reduce_measurements, rms_deviation,
};
use didim::offline::{check_limits, read_log};
use didim::report;
use didim::report::html::{InputFile, Origin, Report, SampleRange};
use didim::text::aligned;
use didim_formats::{CsvError, Measurement, RATE_TOLERANCE, read_bag, read_csv};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE")]
    cell: PathBuf,
    /// The experiment: a CSV file, or a candump log or an MCAP recording of the cell's bus; given again,
    /// further ones of the same arm, for one identification
    #[arg(long, value_name = "FILE", required = true)]
    input: Vec<PathBuf>,
    /// The method; the cell's when left out
    #[arg(long, value_name = "METHOD")]
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
    /// Find the essential parameters among all base parameters, and identify these
    #[arg(long)]
    essential: bool,
    /// Print the composition of each regrouped parameter
    #[arg(long, conflicts_with = "json")]
    regrouping: bool,
}

/// Which samples of a file count.
#[derive(Debug, Args)]
pub(super) struct Samples {
    /// Samples per second of a CSV file without a time_s column
    #[arg(long, value_name = "HZ", value_parser = positive)]
    sample_rate: Option<f64>,
    /// Start of the samples that count [s after the first]; earlier ones are margin for the filters
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// End of the samples that count [s after the first]
    #[arg(long, value_name = "S")]
    to: Option<f64>,
}

impl Samples {
    /// Reads a file of the cell's rate, and says which of its samples count.
    pub(super) fn read(
        &self,
        path: &Path,
        cell: &Cell,
    ) -> Result<(Measurement, Range<usize>), CliError> {
        let measurement = read_input(path, cell, self.sample_rate)?;
        check_rate(&measurement, cell, path)?;
        let counted = counted((self.from, self.to), cell, &measurement, path)?;
        let beyond = check_limits(&measurement, &counted, &cell.robot);
        for one in beyond.map_err(|error| CliError::in_file(path, error))? {
            tracing::warn!("{}: {one}", path.display());
        }
        Ok((measurement, counted))
    }
}

/// What `--json` prints: the estimate, and the run time, which is no part of a result file.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    estimate: &'a Estimate,
    #[serde(skip_serializing_if = "Option::is_none")]
    reduction: Option<&'a Reduction>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    recordings: &'a [RecordingLine],
    elapsed_ms: f64,
}

/// One of several recordings: how well the parameters of all fit it, and how far its own are from those of
/// the others.
#[derive(Serialize)]
struct RecordingLine {
    input: String,
    relative_error: f64,
    /// Root mean square of the differences to the parameters of each other recording, in standard deviations;
    /// nothing where one of the two cannot be identified alone.
    rms_deviation_from: Vec<Option<f64>>,
}

/// Every recording by itself, where there are several.
fn recordings(
    cell: &Cell,
    method: Method,
    arguments: &Arguments,
    measurements: &[(&Measurement, Range<usize>)],
    together: &Estimate,
) -> Vec<RecordingLine> {
    if measurements.len() < 2 {
        return Vec::new();
    }
    let alone: Vec<Option<Estimate>> = (measurements.iter())
        .map(|(measurement, counted)| {
            let found = identify_measurement(cell, method, measurement, counted.clone());
            found.ok().map(|found| found.estimate)
        })
        .collect();
    let named = arguments.input.iter().zip(&together.relative_error_per_recording).enumerate();
    let line = |(index, (path, relative_error)): (usize, (&PathBuf, &f64))| {
        let from = |(other, found): (usize, &Option<Estimate>)| {
            let [one, other] = [alone[index].as_ref(), found.as_ref().filter(|_| other != index)];
            one.zip(other).map(|(one, other)| rms_deviation(one, other))
        };
        RecordingLine {
            input: path.display().to_string(),
            relative_error: *relative_error,
            rms_deviation_from: alone.iter().enumerate().map(from).collect(),
        }
    };
    named.map(line).collect()
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

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let mut cell = Cell::read(&arguments.cell).map_err(CliError::configuration)?;
    let read = (arguments.input.iter())
        .map(|path| arguments.samples.read(path, &cell))
        .collect::<Result<Vec<_>, _>>()?;
    let measurements: Vec<(&Measurement, Range<usize>)> =
        read.iter().map(|(measurement, counted)| (measurement, counted.clone())).collect();
    let first = &arguments.input[0];
    let start = Instant::now();
    let choices = Choices::make(&mut cell, &measurements, first)?;
    // Before the method, which may fail with what was chosen.
    if !arguments.json {
        print(&choices.text(&cell))?;
    }
    let mut reduction = None;
    if arguments.essential {
        let found = reduce_measurements(&cell, &measurements)
            .map_err(|error| CliError::in_file(first, error))?;
        cell = cell.with_parameters(&found.essential);
        reduction = Some(found);
    }
    let method = arguments.method.unwrap_or(cell.method);
    let mut identification =
        identify_measurements(&cell, method, &measurements).map_err(|error| match error {
            IdentifyError::Identification(IdentificationError::NoController { .. })
            | IdentifyError::NotRobust(_) => {
                CliError::configuration(format!("{}: {error}", arguments.cell.display()))
            }
            error => CliError::in_file(first, error),
        })?;
    let elapsed = start.elapsed();
    choices.note_in(&mut identification.estimate);
    let recordings = recordings(&cell, method, arguments, &measurements, &identification.estimate);
    if arguments.json {
        let (estimate, reduction) = (&identification.estimate, reduction.as_ref());
        let elapsed_ms = elapsed.as_secs_f64() * 1e3;
        let output = Output { estimate, reduction, recordings: &recordings, elapsed_ms };
        let json = serde_json::to_string(&output).map_err(CliError::failed)?;
        print(&format!("{json}\n"))?;
    } else {
        if let Some(reduction) = &reduction {
            print(&format!("{}\n", report::reduction::sequence(reduction)))?;
        }
        print(&text(&cell, &identification, arguments.regrouping))?;
        for (measurement, counted) in &measurements {
            print(&what_counted(counted, measurement))?;
        }
        print(&compared(&recordings))?;
    }
    // After the result, which a file that cannot be written must not cost.
    if let Some(path) = &arguments.figure {
        write_figure(path, &cell, &identification)?;
    }
    if let Some(path) = &arguments.report {
        let mut origins = Vec::with_capacity(measurements.len());
        for (path, (measurement, counted)) in arguments.input.iter().zip(&measurements) {
            let input = InputFile::read(path).map_err(|error| CliError::in_file(path, error))?;
            let rate = measurement.signals.sample_rate_hz;
            origins.push((input, SampleRange::Measurement(counted.clone(), rate)));
        }
        let (input, samples) = origins.remove(0);
        let origin = Origin { input: Some(input), samples, further: origins, note: None };
        let report = Report { cell: &cell, identification: &identification, origin: &origin };
        write_report(path, &report)?;
    }
    Ok(())
}

/// A number above 0, as an argument.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let fits = number.is_finite() && number > 0.0;
    fits.then_some(number).ok_or_else(|| "has to be positive and finite".to_owned())
}

/// A file whose name ends in `.csv` is a table, a folder or an MCAP file a ROS 2 bag where the cell asks for one, anything else a
/// candump log or an MCAP recording; without a bus, a table too.
pub(super) fn read_input(
    path: &Path,
    cell: &Cell,
    sample_rate_hz: Option<f64>,
) -> Result<Measurement, CliError> {
    let is =
        |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    if let Some(spec) = cell.bag.as_ref().filter(|_| path.is_dir() || is("mcap") || is("db3")) {
        let (measurement, resampled) = read_bag(path, spec).map_err(CliError::failed)?;
        if !resampled.is_nothing() {
            tracing::warn!("{}: {resampled}", path.display());
        }
        return Ok(measurement);
    }
    // Without a bus there is nothing else that a file could be, but for the logs of one.
    let has_bus = cell.bus().is_ok();
    if is("csv") || !(has_bus || is("log") || is("mcap")) {
        let columns = cell.columns.as_ref();
        let table = match read_csv(path, sample_rate_hz, columns) {
            // The cell says how far its rows are apart.
            Err(CsvError::NoTime { .. }) if !has_bus => {
                read_csv(path, Some(cell.sample_rate_hz()), columns)
            }
            table => table,
        };
        return table.map_err(CliError::failed);
    }
    if sample_rate_hz.is_some() {
        return Err(CliError::Usage(
            "--sample-rate is for CSV files only; a log has the sample rate of the cell's layout"
                .into(),
        ));
    }
    read_log(path, cell).map_err(CliError::failed)
}

/// The layout tells by how much of a sample the torque is late: that holds at the rate of the bus
/// only.
pub(super) fn check_rate(
    measurement: &Measurement,
    cell: &Cell,
    file: &Path,
) -> Result<(), CliError> {
    let (found, rate) = (measurement.signals.sample_rate_hz, cell.sample_rate_hz());
    if (found / rate - 1.0).abs() <= RATE_TOLERANCE {
        return Ok(());
    }
    Err(CliError::in_file(
        file,
        format!(
            "the measurement has {found} samples/s, the cell {rate}; choose a cell of the \
             measurement's rate, or resample the measurement"
        ),
    ))
}

/// What counts: from `--from` to `--to`, or all but the margins of the cell's windows.
fn counted(
    (first_s, last_s): (Option<f64>, Option<f64>),
    cell: &Cell,
    measurement: &Measurement,
    file: &Path,
) -> Result<Range<usize>, CliError> {
    let samples = measurement.samples();
    let rate = measurement.signals.sample_rate_hz;
    let sample = |name: &str, seconds: f64| {
        #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
        let last = (samples - 1) as f64 / rate;
        if !(0.0..=last).contains(&seconds) {
            let message = format!("{name} {seconds}: the measurement lasts from 0 to {last} s");
            return Err(CliError::Usage(message));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the measurement"
        )]
        Ok((seconds * rate).round() as usize)
    };
    let margins = cell.window.plan(rate).map_err(CliError::configuration)?;
    let from = first_s.map_or(Ok(margins.margin_before), |s| sample("--from", s))?;
    let to = match last_s {
        Some(seconds) => sample("--to", seconds)? + 1,
        None => samples.saturating_sub(margins.margin_after),
    };
    if from >= to {
        if let (Some(from), Some(to)) = (first_s, last_s) {
            let message = format!("--from {from} --to {to}: there is no sample between them");
            return Err(CliError::Usage(message));
        }
        let message = format!(
            "no sample counts: of {samples} samples, {from} at the beginning and {} at the end are \
             margin for the filters; record longer, or choose --from and --to",
            samples.saturating_sub(to)
        );
        return Err(CliError::in_file(file, message));
    }
    Ok(from..to)
}

/// Which part of the measurement became rows; the rest is margin for the filters.
fn what_counted(counted: &Range<usize>, measurement: &Measurement) -> String {
    let rate = measurement.signals.sample_rate_hz;
    #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
    let (from, to) = (counted.start as f64 / rate, (counted.end - 1) as f64 / rate);
    let margins = measurement.samples() - counted.len();
    format!("counted from {from} s to {to} s; {margins} samples are margin for the filters\n")
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
