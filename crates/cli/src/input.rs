//! Reads an input file, divides it into pieces at missing samples, selects the samples that count,
//! and checks them against the robot's limits.

use didim_dynamics::robot::{JointIndex, Robot};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use clap::Args;
use didim_drivers::ethercat::Capture;
use didim_drivers::source::{InterfaceName, TextLog};

use super::CliError;
use super::progress::WorkIndicator;
use super::stream::InputFileOrStream;
use didim::analysis::read_log;
use didim::analysis::screening::{LIMITS_REMEDY, check_limits, open_limits, still_joints};
use didim::cell::{Cell, Library, RobotSource, SignalSource, UrdfSection};
use didim::live::recording::is_mcap;
use didim::report::html::SampleRange;
use didim::window::DriveReadings;
use didim_formats::{
    Measurement, Piece, Record, RecordingStart, TimeLimits, foreign_container, is_parquet,
    is_sqlite, read_bag, read_table,
};

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

/// A contiguous piece of a file, and the range of its samples that count.
pub(super) struct CountedPiece {
    pub(super) piece: Piece,
    pub(super) counted_range: Range<usize>,
    /// Time of the first sample of the file, if it is known.
    pub(super) recording_start: Option<RecordingStart>,
    /// Numbers of unused frames and cycles of the file, by cause; empty except for its first piece.
    pub(super) unused_frames: BTreeMap<&'static str, u64>,
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
        for note in record.notes() {
            tracing::warn!("{}: {note}", path.display());
        }
        for piece in &record.segments {
            check_rate(&piece.measurement, cell, path)?;
        }
        let parts = counted_pieces([self.from, self.to], cell, record, path)?;
        if let Some(open) = open_limits(&cell.robot) {
            tracing::warn!("{}: {open}; {LIMITS_REMEDY}", path.display());
        }
        for CountedPiece { piece, counted_range: counted, .. } in &parts {
            let beyond =
                check_limits(&piece.measurement, counted, &cell.robot, cell.screening.limits);
            for one in beyond.map_err(|error| CliError::in_file(path, error))? {
                tracing::warn!("{}: {one}", path.display());
            }
        }
        if let Some(hint) = standstill_text(
            &still_joints(&measurement_pairs(&parts), cell.screening.rest),
            &cell.robot,
        ) {
            tracing::warn!("{}: {hint}", path.display());
        }
        Ok(parts)
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

impl CountedPiece {
    /// Returns true if another piece has the same signals in its samples that count.
    pub(super) fn has_same_signals(&self, other: &Self) -> bool {
        self.counted_range == other.counted_range
            && self.piece.measurement.signals == other.piece.measurement.signals
    }

    /// Returns the times of the first and the last sample that count \[s after the first of the
    /// file\].
    fn times_s(&self) -> [f64; 2] {
        let Self { piece, counted_range: counted, .. } = self;
        [counted.start, counted.end - 1].map(|sample| piece.time_s(sample))
    }

    /// Describes the time range of the samples that count, and the number of samples that are
    /// margin for the filters.
    pub(super) fn counted_text(&self) -> String {
        // Microseconds are enough for people.
        let [from, to] = self.times_s().map(|time_s| (time_s * 1e6).round() / 1e6);
        let margins = self.piece.measurement.samples() - self.counted_range.len();
        format!("counted from {from} s to {to} s; {margins} samples are margin for the filters\n")
    }

    /// Describes the start of the piece, unless it is the start of the file.
    pub(super) fn recording_begin(&self) -> String {
        let begins_s = self.piece.begins_s;
        if begins_s > 0.0 { format!(" from {begins_s:.3} s") } else { String::new() }
    }

    /// Returns the range of samples for a report.
    pub(super) fn sample_range(&self) -> SampleRange {
        let Piece { begins_s, measurement, .. } = &self.piece;
        SampleRange::Measurement {
            counted: self.counted_range.clone(),
            rate_hz: measurement.signals.sample_rate_hz,
            begins_s: *begins_s,
            recorded: self.recording_start,
            readings: self.readings(),
        }
    }

    /// Returns the additional readings of the drives in the samples that count.
    fn readings(&self) -> DriveReadings {
        let readings = self.piece.readings.iter();
        DriveReadings::from_cycles(
            readings.filter(|(at, _)| self.counted_range.contains(at)).map(|(_, of)| of),
        )
    }
}

/// Returns each measurement with the range of its samples that count, as the identification expects
/// them.
pub(super) fn measurement_pairs<'a>(
    parts: impl IntoIterator<Item = &'a CountedPiece>,
) -> Vec<(&'a Measurement, Range<usize>)> {
    parts.into_iter().map(|of| (&of.piece.measurement, of.counted_range.clone())).collect()
}

/// Explains the consequence of joints that never move; joints count from 1.
fn standstill_text(still: &[JointIndex], robot: &Robot) -> Option<String> {
    let named: Vec<String> = still.iter().map(|joint| robot.joint_label(*joint)).collect();
    match named.as_slice() {
        [] => None,
        all if all.len() == robot.joints() => Some(
            "no joint moves beyond its noise in the samples that count: nothing can be identified \
             from a standstill; record a motion, or choose --from and --to where there is one"
                .to_owned(),
        ),
        [one] => Some(format!(
            "joint {one} never moves beyond its noise in the samples that count: its friction \
                and inertia cannot be identified; record it moving, if you need them"
        )),
        _ => Some(format!(
            "joints {} never move beyond their noise in the samples that count: their friction \
                and inertia cannot be identified; record them moving, if you need them",
            named.join(", ")
        )),
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

/// Parses a point from three numbers separated by commas.
pub(super) fn parse_point(text: &str) -> Result<[f64; 3], String> {
    let numbers: [f64; 3] = parse_numbers(text, "give three numbers, as 0,0,0.05")?;
    match numbers.iter().all(|number| number.is_finite()) {
        true => Ok(numbers),
        false => Err("has to be finite".to_owned()),
    }
}

/// Reads an input file. The first bytes of a stream identify its format. The format of a file is:
///
/// - A name that ends in `.csv` or `.csv.gz`, or a Parquet file: a table.
/// - A folder, an MCAP or SQLite file: a ROS 2 bag, if the cell asks for one.
/// - Anything else: a log (candump, ASC, TRC), an MCAP recording or an EtherCAT capture. Without a
///   bus it may also be a table.
pub(super) fn read_input(
    input: &InputFileOrStream,
    cell: &Cell,
    sample_rate_hz: Option<f64>,
    interfaces: &[InterfaceName],
) -> Result<Record, CliError> {
    input.with_displayed_path(read_file(input, cell, sample_rate_hz, interfaces))
}

/// Returns the format of an input file, as [`read_input`] reads it.
pub(super) fn signal_source(input: &InputFileOrStream, cell: &Cell) -> SignalSource {
    let path = input.path();
    let is =
        |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let is_mcap_bag = is("mcap") || (input.is_stream() && is_mcap(path));
    let is_bag = path.is_dir() || is_mcap_bag || is("db3") || is_sqlite(path);
    if cell.bag.is_some() && is_bag {
        return SignalSource::Bag;
    }
    // Without a bus a file can only be a table, unless it has the format of a bus log.
    let has_bus = cell.bus().is_ok();
    let is_text = is("csv") || path.to_string_lossy().to_lowercase().ends_with(".csv.gz");
    let is_table = is_text || is_parquet(path);
    let is_log = match input.is_stream() {
        true => is_mcap(path) || Capture::is_one(path) || TextLog::is_one(path),
        false => has_bus || ["log", "asc", "trc", "mcap", "pcap", "pcapng"].into_iter().any(is),
    };
    if is_table || !is_log { SignalSource::Table } else { SignalSource::Bus }
}

fn read_file(
    input: &InputFileOrStream,
    cell: &Cell,
    sample_rate_hz: Option<f64>,
    interfaces: &[InterfaceName],
) -> Result<Record, CliError> {
    let (path, source) = (input.path(), signal_source(input, cell));
    if let Some(spec) = cell.bag.as_ref().filter(|_| source == SignalSource::Bag) {
        return read_bag(path, spec).map_err(CliError::from_failure);
    }
    if let Some(container) = foreign_container(path) {
        return Err(CliError::in_file(path, container));
    }
    let has_bus = cell.bus().is_ok();
    if source == SignalSource::Table {
        // A cell without a bus defines the row interval of its tables.
        let rate_hz = sample_rate_hz.or((!has_bus).then(|| cell.sample_rate_hz()));
        return read_table(path, rate_hz, cell.sample_rate_hz(), cell.columns.as_ref())
            .map_err(CliError::from_failure);
    }
    if sample_rate_hz.is_some() {
        return Err(CliError::Usage(
            "--sample-rate is for tables only; a log has the sample rate of the cell's layout"
                .into(),
        ));
    }
    read_log(path, cell, interfaces).map_err(CliError::from_failure)
}

/// Checks that the measurement has the sample rate of the cell. The layout declares the torque
/// delay as a fraction of a sample, and this fraction is valid only at the rate of the bus.
pub(super) fn check_rate(
    measurement: &Measurement,
    cell: &Cell,
    file: &Path,
) -> Result<(), CliError> {
    let (found, rate) = (measurement.signals.sample_rate_hz, cell.sample_rate_hz());
    if (found / rate - 1.0).abs() <= TimeLimits::DEFAULT.same_rate {
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

/// Returns the range of each piece that counts: from `--from` to `--to`, or all but the margins of
/// the cell's windows. Pieces without such samples are left out.
fn counted_pieces(
    [first_s, last_s]: [Option<f64>; 2],
    cell: &Cell,
    record: Record,
    file: &Path,
) -> Result<Vec<CountedPiece>, CliError> {
    let end_s = record.segments.last().map_or(0.0, Piece::ends_s);
    for (name, seconds) in [("--from", first_s), ("--to", last_s)] {
        // Half a sample is tolerated, because the user may enter a displayed time, which is
        // rounded.
        let last_s = end_s + 0.5 / cell.sample_rate_hz();
        if let Some(seconds) = seconds.filter(|seconds| !(0.0..=last_s).contains(seconds)) {
            let message = format!("{name} {seconds}: the measurement lasts from 0 to {end_s} s");
            return Err(CliError::Usage(message));
        }
    }
    let margins = cell.window.plan(cell.sample_rate_hz()).map_err(CliError::from_configuration)?;
    let ranges: Vec<Range<usize>> = record
        .segments
        .iter()
        .map(|piece: &Piece| {
            let samples = piece.measurement.samples();
            let sample = |seconds: f64| {
                let after = (seconds - piece.begins_s) * piece.measurement.signals.sample_rate_hz;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "within the measurement, or 0"
                )]
                let sample = after.round().max(0.0) as usize;
                sample
            };
            // A limit from the command line applies if it lies in the piece; otherwise the margin
            // applies.
            let half_s = 0.5 / piece.measurement.signals.sample_rate_hz;
            let within = |seconds: &f64| {
                (piece.begins_s - half_s..=piece.ends_s() + half_s).contains(seconds)
            };
            let begin = match first_s {
                Some(seconds) if within(&seconds) => sample(seconds),
                Some(seconds) if seconds > piece.begins_s => samples,
                _ => margins.margin_before,
            };
            let end = match last_s {
                Some(seconds) if within(&seconds) => sample(seconds) + 1,
                Some(seconds) if seconds < piece.begins_s => 0,
                _ => samples.saturating_sub(margins.margin_after),
            };
            begin..end.min(samples)
        })
        .collect();
    let samples: usize = record.segments.iter().map(|piece| piece.measurement.samples()).sum();
    let row = cell.options.decimation_filter.factor;
    let (recorded, mut unused_frames) = (record.recording_start, record.unused_frames);
    let (parts, first) = (record.segments.len(), ranges.first().cloned().unwrap_or_default());
    let counted: Vec<CountedPiece> = (record.segments.into_iter().zip(ranges))
        // If there are several pieces, those too short for a row are left out.
        .filter(|(_, counted)| counted.len() >= if parts > 1 { row } else { 1 })
        .map(|(piece, counted)| CountedPiece {
            piece,
            counted_range: counted,
            recording_start: recorded,
            unused_frames: core::mem::take(&mut unused_frames),
        })
        .collect();
    check_not_empty([first_s, last_s], file, samples, parts, &first, &counted)?;
    if counted.len() < parts {
        tracing::warn!(
            "{}: of {parts} pieces {} have samples that count",
            file.display(),
            counted.len()
        );
    }
    Ok(counted)
}

/// Returns an error if no sample of the record counts. `first` is the range of the first piece.
fn check_not_empty(
    [first_s, last_s]: [Option<f64>; 2],
    file: &Path,
    samples: usize,
    parts: usize,
    first: &Range<usize>,
    counted: &[CountedPiece],
) -> Result<(), CliError> {
    if counted.is_empty() {
        if let (Some(from), Some(to)) = (first_s, last_s) {
            let problem = match parts {
                1 => "there is no sample between them".to_owned(),
                _ => format!("none of {parts} pieces has enough samples between them"),
            };
            return Err(CliError::Usage(format!("--from {from} --to {to}: {problem}")));
        }
        let message = if parts > 1 {
            format!(
                "no sample counts: each of the {parts} pieces of {samples} samples is margin for \
                the filters; record without losses"
            )
        } else {
            format!(
                "no sample counts: of {samples} samples, {} at the beginning and {} at the end are \
                 margin for the filters; record longer, or choose --from and --to",
                first.start,
                samples.saturating_sub(first.end)
            )
        };
        return Err(CliError::in_file(file, message));
    }
    Ok(())
}
