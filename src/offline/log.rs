//! Logs, MCAP recordings and captures of the bus: the same frames, layout and assembly as live.

use std::path::{Path, PathBuf};

use didim_core::{JointSample, Readings};
use didim_drivers::assemble::{Losses, label};
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::samples::Samples;
use didim_drivers::source::SourceError;

use super::rate::{RateError, check_rate};
use crate::cell::{Cell, CellBus, CellError};
use crate::live::recording::open_log;
use didim_formats::{Measurement, Piece, Record, RecordingStart, Resampled, Room};

/// Frames taken from the log at a time.
const BATCH: usize = 4096;
/// Identifiers that an error lists.
const LISTED: usize = 16;

/// Why a log is no measurement. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The log cannot be opened or read, or a line is malformed; the inner error names it.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The cell has no bus.
    #[error(transparent)]
    Cell(Box<CellError>),
    /// No complete sample came of the frames: the layout or the interface is another one.
    #[error(
        "{}: no complete sample in {} frames; is this log from the bus that the cell's layout describes? The layout has the identifiers {}, the log {}. Not used, by cause: {}",
        file.display(), losses.frames_received, list(expected), list(found), causes(losses)
    )]
    NoSample {
        /// The log.
        file: PathBuf,
        /// Identifiers of the layout.
        expected: Vec<FrameId>,
        /// The first identifiers of the log.
        found: Vec<FrameId>,
        /// What was counted.
        losses: Box<Losses>,
    },
    /// The stamps tell another sample rate than the layout, or none.
    #[error("{}: {source}", file.display())]
    Rate {
        /// The log.
        file: PathBuf,
        /// Both rates, and what to do.
        source: RateError,
    },
    /// More samples than memory and disk have room for: free some, or cut the log.
    #[error("{}: more than {samples} samples, for which memory or disk is free; free some, set TMPDIR to a folder on a disk with room, or cut the log", file.display())]
    TooLong {
        /// The log.
        file: PathBuf,
        /// What there is room for.
        samples: usize,
    },
}

/// Reads a whole log, MCAP recording or capture, motor side, cut where bus cycles are missing and where a drive changes
/// its mode.
///
/// Where targets take effect at the next SYNC, no target is known in the log's first cycle: the
/// measurement begins with the second one.
///
/// # Errors
/// See [`LogError`].
pub fn read_log(path: &Path, cell: &Cell) -> Result<Record, LogError> {
    let bus = cell.bus().map_err(|source| LogError::Cell(Box::new(source)))?;
    let (samples, since_1970_ns) = read_samples(path, bus)?;
    // Over all of them: gaps do no harm to it, and a short piece alone tells no rate.
    let rate_unchecked = check_rate(&samples, &bus.layout)
        .map_err(|source| LogError::Rate { file: path.to_path_buf(), source })?;
    // Of those that count, the first: set with the first piece.
    let (mut first, mut start) = (None, None);
    let (mut left_out, mut without_reference) = (0, 0);
    let piece = |samples: &[JointSample]| {
        let all = samples;
        let samples = if bus.layout.has_reference() { from_reference(all) } else { all };
        left_out += all.len() - samples.len();
        without_reference += samples.iter().filter(|sample| !sample.has_reference).count();
        let of_layout =
            Measurement::from_samples(samples, bus.layout.axes(), 1e9 / bus.layout.period_ns());
        let begin = samples.first().map_or(0, |sample| sample.sequence);
        start = start.or(samples.first().map(|sample| sample.stamp_ns));
        let cycles = begin - *first.get_or_insert(begin);
        #[expect(clippy::cast_precision_loss, reason = "cycles are far fewer than 2^52")]
        let begins_s = cycles as f64 * bus.layout.period_ns() * 1e-9;
        let told = samples.iter().map(|sample| sample.readings).enumerate();
        let readings = told.filter(|(_, readings)| !readings.is_empty()).collect();
        Piece { begins_s, measurement: Measurement { rate_unchecked, ..of_layout }, readings }
    };
    let mut modes = Readings::default();
    let is_whole = |one: &JointSample, next: &JointSample| {
        modes.update(&one.readings);
        next.sequence == one.sequence + 1 && !next.readings.changes_mode(&modes)
    };
    let pieces: Vec<Piece> = samples.chunk_by(is_whole).map(piece).collect();
    let (file, all) = (path.display(), samples.len());
    if left_out > 0 {
        let sample =
            if left_out == 1 { "1 sample".to_owned() } else { format!("{left_out} samples") };
        let is = if left_out == 1 { "is" } else { "are" };
        tracing::warn!("{file}: {sample} before the first reference {is} left out");
    }
    if bus.layout.has_reference() && without_reference > 0 {
        tracing::warn!(
            "{file}: {without_reference} of {all} samples have no reference, so the reference is not used"
        );
    }
    let start_ns = start.map(|stamp_ns| i128::from(stamp_ns) + i128::from(since_1970_ns));
    let start = start_ns.and_then(RecordingStart::of_unix_ns);
    Ok(Record { pieces, resampled: Resampled::default(), holes: None, start })
}

/// A target takes effect at the SYNC after its frame, so that the first cycle of a piece has none. Without this, one
/// sample would cost the whole its reference. More than one is no matter of the beginning: then nothing is left out, and
/// the measurement has no reference.
fn from_reference(samples: &[JointSample]) -> &[JointSample] {
    match samples {
        [first, rest @ ..]
            if !first.has_reference && rest.first().is_some_and(|s| s.has_reference) =>
        {
            rest
        }
        all => all,
    }
}

/// The samples, and what to add to their stamps; see [`since_1970_ns`](didim_drivers::source::Source::since_1970_ns).
fn read_samples(path: &Path, bus: &CellBus) -> Result<(Vec<JointSample>, i64), LogError> {
    let file = || path.to_path_buf();
    let mut found: Vec<FrameId> = Vec::new();
    let list_identifiers = |frames: &[Frame], _| {
        for frame in frames.iter().filter(|frame| !frame.is_error()) {
            if found.len() < LISTED && !found.contains(&frame.id) {
                found.push(frame.id);
            }
        }
    };
    let source = open_log(path, Some(&bus.layout))?;
    let since_1970_ns = source.since_1970_ns();
    let mut of_log =
        Samples::new(source, bus.assembler(), BATCH).with_tap(Some(Box::new(list_identifiers)));
    // A vector that grows stands there twice.
    let room = Room::of_bytes(3 * size_of::<JointSample>());
    let mut samples: Vec<JointSample> = Vec::new();
    for sample in &mut of_log {
        samples.push(sample?);
        if samples.len() > room.samples {
            return Err(LogError::TooLong { file: file(), samples: room.samples });
        }
    }
    let losses = Box::new(*of_log.losses());
    drop(of_log);
    if samples.is_empty() {
        let expected = bus.layout.messages().iter().map(|message| message.format.id).collect();
        return Err(LogError::NoSample { file: file(), expected, found, losses });
    }
    if samples.windows(2).any(|pair| pair[1].sequence != pair[0].sequence + 1) {
        tracing::warn!(
            "{}: bus cycles are missing; not used, by cause: {}",
            path.display(),
            causes(&losses)
        );
    }
    Ok((samples, since_1970_ns))
}

/// The first identifiers, as candump writes them.
fn list(ids: &[FrameId]) -> String {
    let names: Vec<String> = ids.iter().take(LISTED).map(ToString::to_string).collect();
    match names.len() {
        0 => "none".to_owned(),
        listed if listed < ids.len() => format!("{} …", names.join(" ")),
        _ => names.join(" "),
    }
}

/// Every cause with a count, as `name 12, name 3`.
fn causes(losses: &Losses) -> String {
    let all = losses.frames.by_cause().chain(losses.cycles.by_cause());
    let found = all.filter(|(_, count)| *count > 0);
    let found: Vec<String> = found.map(|(key, count)| format!("{} {count}", label(key))).collect();
    if found.is_empty() { "none".to_owned() } else { found.join(", ") }
}
