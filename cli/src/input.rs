//! The samples of a file that count: read, cut where some are missing, held against the robot's limits.

use std::ops::Range;
use std::path::Path;

use clap::Args;
use didim_drivers::ethercat::Capture;
use didim_drivers::source::TextLog;

use super::CliError;
use super::progress::Working;
use super::stream::Input;
use didim::cell::Cell;
use didim::live::recording::is_mcap;
use didim::offline::{STATE_LIMITS, check_limits, open_limits, read_log, still_joints};
use didim::report::html::SampleRange;
use didim::window::DriveReadings;
use didim_formats::{
    Measurement, Piece, RATE_TOLERANCE, Record, RecordingStart, Spill, is_parquet, read_bag,
    read_table,
};

/// Which samples of a file count.
#[derive(Debug, Default, Args)]
pub(super) struct Samples {
    /// Samples per second of a table without a column of the time
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    sample_rate: Option<f64>,
    /// Start of the samples that count [s after the first]; earlier ones are margin for the filters
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// End of the samples that count [s after the first]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
}

/// A whole piece of a file, and which of its samples count.
pub(super) struct Counted {
    pub(super) piece: Piece,
    pub(super) counted: Range<usize>,
    /// When the first sample of the file was recorded, where that is known.
    pub(super) recorded: Option<RecordingStart>,
}

impl Samples {
    /// Reads a file of the cell's rate, and says which of its samples count: at least one piece has some.
    pub(super) fn read(&self, input: &Input, cell: &Cell) -> Result<Vec<Counted>, CliError> {
        let path = input.shown();
        let reading = Working::on(&format!("reading {}", path.display()));
        let record = reading.during(|| read_input(input, cell, self.sample_rate))?;
        for note in record.notes() {
            tracing::warn!("{}: {note}", path.display());
        }
        for piece in &record.pieces {
            check_rate(&piece.measurement, cell, path)?;
        }
        let pieces = counted([self.from, self.to], cell, record, path)?;
        if let Some(open) = open_limits(&cell.robot) {
            tracing::warn!("{}: {open}; {STATE_LIMITS}", path.display());
        }
        for Counted { piece, counted, .. } in &pieces {
            let beyond = check_limits(&piece.measurement, counted, &cell.robot);
            for one in beyond.map_err(|error| CliError::in_file(path, error))? {
                tracing::warn!("{}: {one}", path.display());
            }
        }
        if let Some(hint) = standstill(&still_joints(&pairs(&pieces)), cell.robot.joints()) {
            tracing::warn!("{}: {hint}", path.display());
        }
        Ok(pieces)
    }

    /// The same, where one whole piece is wanted: the longest.
    pub(super) fn read_longest(&self, input: &Input, cell: &Cell) -> Result<Counted, CliError> {
        let path = input.shown();
        let pieces = self.read(input, cell)?;
        let others = pieces.len() > 1;
        let longest = pieces.into_iter().max_by_key(|of| of.counted.len());
        let longest = longest.ok_or_else(|| CliError::in_file(path, "no sample counts"))?;
        if others {
            let [from, to] = longest.times_s();
            tracing::warn!(
                "{}: the longest piece counts here, {from} to {to} s, and no other",
                path.display()
            );
        }
        Ok(longest)
    }
}

impl Counted {
    /// Of the first and the last sample that count \[s after the first of the file\].
    fn times_s(&self) -> [f64; 2] {
        let Self { piece, counted, .. } = self;
        [counted.start, counted.end - 1].map(|sample| piece.time_s(sample))
    }

    /// Which part of the file became rows; the rest is margin for the filters.
    pub(super) fn what_counted(&self) -> String {
        let [from, to] = self.times_s();
        let margins = self.piece.measurement.samples() - self.counted.len();
        format!("counted from {from} s to {to} s; {margins} samples are margin for the filters\n")
    }

    /// Where the piece begins, unless with the file.
    pub(super) fn begin(&self) -> String {
        let begins_s = self.piece.begins_s;
        if begins_s > 0.0 { format!(" from {begins_s:.3} s") } else { String::new() }
    }

    /// For a report.
    pub(super) fn range(&self) -> SampleRange {
        let Piece { begins_s, measurement, .. } = &self.piece;
        SampleRange::Measurement {
            counted: self.counted.clone(),
            rate_hz: measurement.signals.sample_rate_hz,
            begins_s: *begins_s,
            recorded: self.recorded,
            readings: self.readings(),
        }
    }

    /// What the drives told besides along the samples that count.
    fn readings(&self) -> DriveReadings {
        let all = self.piece.readings.iter();
        DriveReadings::of(all.filter(|(at, _)| self.counted.contains(at)).map(|(_, of)| of))
    }
}

/// As identifications take them.
pub(super) fn pairs<'a>(
    pieces: impl IntoIterator<Item = &'a Counted>,
) -> Vec<(&'a Measurement, Range<usize>)> {
    pieces.into_iter().map(|of| (&of.piece.measurement, of.counted.clone())).collect()
}

/// What it means that joints, from 1, never move.
fn standstill(still: &[usize], joints: usize) -> Option<String> {
    let named: Vec<String> = still.iter().map(ToString::to_string).collect();
    match still {
        [] => None,
        all if all.len() == joints => Some(
            "no joint moves beyond its noise in the samples that count: nothing can be identified from a standstill; \
             record a motion, or choose --from and --to where there is one"
                .to_owned(),
        ),
        [one] => Some(format!(
            "joint {one} never moves beyond its noise in the samples that count: they tell nothing of its friction and inertia; \
             move it too, where that is wanted"
        )),
        _ => Some(format!(
            "joints {} never move beyond their noise in the samples that count: they tell nothing of their friction and inertia; \
             move them too, where that is wanted",
            named.join(" ")
        )),
    }
}

/// A number above 0, as an argument.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let fits = number.is_finite() && number > 0.0;
    fits.then_some(number).ok_or_else(|| "has to be positive and finite".to_owned())
}

/// So many numbers with commas between them; where there are more or fewer, the error is what to give.
pub(super) fn numbers<const N: usize>(text: &str, give: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(|number| number.trim().parse::<f64>());
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    numbers.try_into().map_err(|_| give.to_owned())
}

/// A point as three numbers with commas between them.
pub(super) fn centre(text: &str) -> Result<[f64; 3], String> {
    let all: [f64; 3] = numbers(text, "give three numbers, as 0,0,0.05")?;
    match all.iter().all(|number| number.is_finite()) {
        true => Ok(all),
        false => Err("has to be finite".to_owned()),
    }
}

/// What comes as a stream is told by its first bytes. A file whose name ends in `.csv` or `.csv.gz` and one of Parquet is a table, a folder or an MCAP file a ROS 2 bag where the cell asks for one, anything else a
/// log (candump, ASC, TRC), an MCAP recording or a capture of EtherCAT; without a bus, a table too.
pub(super) fn read_input(
    input: &Input,
    cell: &Cell,
    sample_rate_hz: Option<f64>,
) -> Result<Record, CliError> {
    Spill::allow();
    input.named(read_file(input, cell, sample_rate_hz))
}

fn read_file(input: &Input, cell: &Cell, sample_rate_hz: Option<f64>) -> Result<Record, CliError> {
    let path = input.path();
    let is =
        |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let is_bag = path.is_dir() || is("mcap") || is("db3") || (input.is_stream() && is_mcap(path));
    if let Some(spec) = cell.bag.as_ref().filter(|_| is_bag) {
        return read_bag(path, spec).map_err(CliError::failed);
    }
    // Without a bus there is nothing else that a file could be, but for the logs of one.
    let has_bus = cell.bus().is_ok();
    let is_text = is("csv") || path.to_string_lossy().to_lowercase().ends_with(".csv.gz");
    let is_table = is_text || is_parquet(path);
    let is_log = match input.is_stream() {
        true => is_mcap(path) || Capture::is_one(path) || TextLog::is_one(path),
        false => has_bus || ["log", "asc", "trc", "mcap", "pcap", "pcapng"].into_iter().any(is),
    };
    if is_table || !is_log {
        // Such a cell says how far the rows of its tables are apart.
        let stated = sample_rate_hz.or((!has_bus).then(|| cell.sample_rate_hz()));
        return read_table(path, stated, cell.sample_rate_hz(), cell.columns.as_ref())
            .map_err(CliError::failed);
    }
    if sample_rate_hz.is_some() {
        return Err(CliError::Usage(
            "--sample-rate is for tables only; a log has the sample rate of the cell's layout"
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

/// What counts of each piece: from `--from` to `--to`, or all but the margins of the cell's windows. Pieces of which
/// nothing counts are left out.
fn counted(
    [first_s, last_s]: [Option<f64>; 2],
    cell: &Cell,
    record: Record,
    file: &Path,
) -> Result<Vec<Counted>, CliError> {
    let end_s = record.pieces.last().map_or(0.0, Piece::ends_s);
    for (name, seconds) in [("--from", first_s), ("--to", last_s)] {
        // Times are shown rounded.
        let last_s = end_s + 0.5 / cell.sample_rate_hz();
        if let Some(seconds) = seconds.filter(|seconds| !(0.0..=last_s).contains(seconds)) {
            let message = format!("{name} {seconds}: the measurement lasts from 0 to {end_s} s");
            return Err(CliError::Usage(message));
        }
    }
    let margins = cell.window.plan(cell.sample_rate_hz()).map_err(CliError::configuration)?;
    let of_piece = |piece: &Piece| {
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
        // An end that is stated lies in the piece, or the piece ends with its margin.
        let half_s = 0.5 / piece.measurement.signals.sample_rate_hz;
        let within =
            |seconds: &f64| (piece.begins_s - half_s..=piece.ends_s() + half_s).contains(seconds);
        let from = match first_s {
            Some(seconds) if within(&seconds) => sample(seconds),
            Some(seconds) if seconds > piece.begins_s => samples,
            _ => margins.margin_before,
        };
        let to = match last_s {
            Some(seconds) if within(&seconds) => sample(seconds) + 1,
            Some(seconds) if seconds < piece.begins_s => 0,
            _ => samples.saturating_sub(margins.margin_after),
        };
        from..to.min(samples)
    };
    let all: Vec<Range<usize>> = record.pieces.iter().map(of_piece).collect();
    let samples: usize = record.pieces.iter().map(|piece| piece.measurement.samples()).sum();
    let row = cell.options.decimation_filter.factor;
    let recorded = record.start;
    let (pieces, first) = (record.pieces.len(), all.first().cloned().unwrap_or_default());
    let counted: Vec<Counted> = (record.pieces.into_iter().zip(all))
        // Where there are several, those that make no row are left out.
        .filter(|(_, counted)| counted.len() >= if pieces > 1 { row } else { 1 })
        .map(|(piece, counted)| Counted { piece, counted, recorded })
        .collect();
    if counted.is_empty() {
        if let (Some(from), Some(to)) = (first_s, last_s) {
            let what = match pieces {
                1 => "there is no sample between them".to_owned(),
                _ => format!("none of {pieces} pieces has enough samples between them"),
            };
            return Err(CliError::Usage(format!("--from {from} --to {to}: {what}")));
        }
        let message = if pieces > 1 {
            format!(
                "no sample counts: each of the {pieces} pieces of {samples} samples is margin for the filters; record without losses"
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
    if counted.len() < pieces {
        tracing::warn!(
            "{}: of {pieces} pieces {} have samples that count",
            file.display(),
            counted.len()
        );
    }
    Ok(counted)
}
