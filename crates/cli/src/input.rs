//! Input files of commands: a robot, a recording, and the samples of a recording that count.

use std::path::Path;

use clap::Args;
use didim_drivers::source::InterfaceName;

use super::CliError;
use super::progress::WorkIndicator;
use super::stream::InputFileOrStream;
use didim::analysis::{
    CountError, CountedPiece, RecordingError, count_samples, read_recording, recording_source,
};
use didim::cell::{Cell, Library, RobotSource, SignalSource, UrdfSection};
use didim_formats::Record;

/// Reads a robot file, or a URDF with the ends of its arm.
pub(super) fn read_robot(
    file: &Path,
    base: Option<&String>,
    tip: Option<&String>,
) -> Result<RobotSource, CliError> {
    let text = Library::Files.read(file).map_err(CliError::from_configuration)?;
    let ends = UrdfSection { base: base.cloned(), tip: tip.cloned(), ..UrdfSection::default() };
    let source =
        RobotSource::read(file, text, Some(&ends)).map_err(CliError::from_configuration)?;
    if source.urdf.is_none() && (base.is_some() || tip.is_some()) {
        let explanation =
            "--base and --tip are links of a URDF, and this is a robot file; leave them out";
        return Err(CliError::Usage(explanation.to_owned()));
    }
    Ok(source)
}

/// Selection of the samples of a file that count.
#[derive(Debug, Default, Args)]
pub(super) struct Samples {
    /// Samples per second of a table without a time column
    #[arg(long, value_name = "HZ", value_parser = parse_positive, allow_negative_numbers = true)]
    sample_rate: Option<f64>,
    /// The interface of a log or a recording whose frames count; repeat for several. Without it
    /// those of the cell's bus, where several have the same identifiers
    #[arg(long = "interface", value_name = "NAME")]
    interfaces: Vec<InterfaceName>,
    /// Start of the samples that count [s after the first]; earlier ones are margin for the filters
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// End of the samples that count [s after the first]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
}

impl Samples {
    /// Reads a file with the cell's rate and selects the samples that count. Returns only pieces
    /// with such samples, and at least one piece.
    pub(super) fn read(
        &self,
        input: &InputFileOrStream,
        cell: &Cell,
    ) -> Result<Vec<CountedPiece>, CliError> {
        let path = input.displayed_path();
        let reading = WorkIndicator::start(&format!("reading {}", path.display()));
        let record =
            reading.show_during(|| read_input(input, cell, self.sample_rate, &self.interfaces))?;
        let warn = |warning| tracing::warn!("{}: {warning}", path.display());
        let counted = count_samples(record, cell, [self.from, self.to], warn);
        counted.map_err(|error| count_error(path, error))
    }

    /// Reads a file like [`Self::read`] and returns only its longest piece.
    pub(super) fn read_longest(
        &self,
        input: &InputFileOrStream,
        cell: &Cell,
    ) -> Result<CountedPiece, CliError> {
        let path = input.displayed_path();
        let parts = self.read(input, cell)?;
        let others = parts.len() > 1;
        let longest = parts.into_iter().max_by_key(|of| of.counted_range.len());
        let longest = longest.ok_or_else(|| CliError::in_file(path, "no sample counts"))?;
        if others {
            let [from, to] = longest.times_s();
            tracing::warn!("{}: only the longest piece counts, {from} to {to} s", path.display());
        }
        Ok(longest)
    }
}

/// Parses an argument as a positive number.
pub(super) fn parse_positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let fits = number.is_finite() && number > 0.0;
    fits.then_some(number).ok_or_else(|| "has to be positive and finite".to_owned())
}

/// Parses N numbers separated by commas. If the text has another number of values, the error is
/// `give`, which names the expected input.
pub(super) fn parse_numbers<const N: usize>(text: &str, give: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(|number| number.trim().parse::<f64>());
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    numbers.try_into().map_err(|_| give.to_owned())
}

/// Parses N finite numbers like [`parse_numbers`].
pub(super) fn parse_finite<const N: usize>(text: &str, give: &str) -> Result<[f64; N], String> {
    let numbers: [f64; N] = parse_numbers(text, give)?;
    match numbers.iter().all(|number| number.is_finite()) {
        true => Ok(numbers),
        false => Err("has to be finite".to_owned()),
    }
}

/// Parses a point from three numbers separated by commas.
pub(super) fn parse_point(text: &str) -> Result<[f64; 3], String> {
    parse_finite(text, "give three numbers, as 0,0,0.05")
}

/// Reads an input file in its format; see [`read_recording`].
pub(super) fn read_input(
    input: &InputFileOrStream,
    cell: &Cell,
    sample_rate_hz: Option<f64>,
    interfaces: &[InterfaceName],
) -> Result<Record, CliError> {
    let record =
        read_recording(input.path(), input.is_stream(), cell, (sample_rate_hz, interfaces));
    input.with_displayed_path(record.map_err(|error| match error {
        RecordingError::RateOfLog => CliError::Usage(error.to_string()),
        error => CliError::from_failure(error),
    }))
}

/// Returns the format of an input file, as [`read_input`] reads it.
pub(super) fn signal_source(input: &InputFileOrStream, cell: &Cell) -> SignalSource {
    recording_source(input.path(), input.is_stream(), cell)
}

/// Returns the error of a recording's samples. Limits of the command line are a matter of usage.
pub(super) fn count_error(file: &Path, error: CountError) -> CliError {
    match error {
        CountError::Outside { .. } | CountError::NoneBetween { .. } => {
            CliError::Usage(error.to_string())
        }
        CountError::Windows(error) => CliError::from_configuration(error),
        error => CliError::in_file(file, error),
    }
}
