//! Logs, MCAP recordings and captures of the bus, with the same frames, layout and assembly as live
//! data.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use didim_drivers::assemble::{Losses, label};
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::samples::Samples;
use didim_drivers::source::{InterfaceName, SourceError};
use didim_dynamics::{JointSample, Readings};

use super::screening::{RateError, check_rate};
use crate::cell::{Cell, CellBus, CellError};
use crate::live::recording::{NamedInterfaces, OpenLogError, open_bus_log};
use didim_formats::{Capacity, Measurement, Piece, Record, RecordingStart};

/// Number of frames taken from the log at a time.
const BATCH_FRAMES: usize = 4096;
/// Maximum number of identifiers that an error lists.
const MAX_LISTED_IDS: usize = 16;

/// Error when a log yields no measurement. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The log cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenLogError),
    /// The log cannot be read, or a line is malformed; the inner error names it.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The cell has no bus.
    #[error(transparent)]
    Cell(Box<CellError>),
    /// The frames yield no complete sample: the layout or the interface is a different one.
    #[error(
        "{}: no complete sample in {} frames; is this log from the bus that the cell's layout \
        describes? The layout has the identifiers {}, the log {}. Not used, by cause: {}",
        file.display(), losses.frames_received, list(expected), list(found), loss_causes(losses)
    )]
    NoSample {
        /// The log.
        file: PathBuf,
        /// Identifiers that the layout contains.
        expected: Vec<FrameId>,
        /// The first identifiers found in the log.
        found: Vec<FrameId>,
        /// Counts of lost frames and cycles.
        losses: Box<Losses>,
    },
    /// The time stamps give a sample rate that differs from the layout's, or no sample rate.
    #[error("{}: {source}", file.display())]
    Rate {
        /// The log.
        file: PathBuf,
        /// The mismatch, with both rates and the remedy.
        source: RateError,
    },
    /// The log has more samples than the free memory holds. Free memory, or cut the log.
    #[error("{}: more than {samples} samples, for which memory is free; free some, or cut the log",
        file.display())]
    TooLong {
        /// The log.
        file: PathBuf,
        /// Number of samples within the capacity.
        samples: usize,
    },
}

/// Reads a complete log, MCAP recording or capture into a motor-side measurement. Splits it where
/// bus cycles are missing and where a drive changes its mode.
///
/// If targets take effect at the next SYNC, no target is known in the log's first cycle. The
/// measurement then begins with the second one. If `interfaces` is empty, those of the cell's bus
/// count where several carry the same identifiers.
///
/// # Errors
/// See [`LogError`].
pub fn read_log(
    path: &Path,
    cell: &Cell,
    interfaces: &[InterfaceName],
) -> Result<Record, LogError> {
    let bus = cell.bus().map_err(|source| LogError::Cell(Box::new(source)))?;
    let LogSamples { samples, since_1970_ns, unused_frames } = read_samples(path, bus, interfaces)?;
    // The check covers all samples. Gaps do not affect it, whereas a short piece alone determines
    // no rate.
    let rate_unchecked = check_rate(&samples, &bus.layout, cell.screening.rate)
        .map_err(|source| LogError::Rate { file: path.to_path_buf(), source })?;
    // First sequence number and stamp of the samples in use; the first piece sets both.
    let (mut first, mut start) = (None, None);
    let (mut left_out, mut without_reference) = (0, 0);
    let mut modes = Readings::default();
    let parts: Vec<Piece> = samples
        .chunk_by(|one: &JointSample, next: &JointSample| {
            modes.update(&one.readings);
            next.sequence == one.sequence + 1 && !next.readings.changes_mode(&modes)
        })
        .map(|samples: &[JointSample]| {
            let total = samples;
            let samples = if bus.layout.has_reference() { from_reference(total) } else { total };
            left_out += total.len() - samples.len();
            without_reference += samples.iter().filter(|sample| !sample.has_reference).count();
            let of_layout =
                Measurement::from_samples(samples, bus.layout.axes(), 1e9 / bus.layout.period_ns());
            let begin = samples.first().map_or(0, |sample| sample.sequence);
            start = start.or(samples.first().map(|sample| sample.stamp_ns));
            let cycles = begin - *first.get_or_insert(begin);
            #[expect(clippy::cast_precision_loss, reason = "cycles are far fewer than 2^52")]
            let begins_s = cycles as f64 * bus.layout.period_ns() * 1e-9;
            let numbered = samples.iter().map(|sample| sample.readings).enumerate();
            let readings = numbered.filter(|(_, readings)| !readings.is_empty()).collect();
            Piece { begins_s, measurement: Measurement { rate_unchecked, ..of_layout }, readings }
        })
        .collect();
    let (file, all) = (path.display(), samples.len());
    if left_out > 0 {
        let sample =
            if left_out == 1 { "1 sample".to_owned() } else { format!("{left_out} samples") };
        let is = if left_out == 1 { "is" } else { "are" };
        tracing::warn!("{file}: {sample} before the first reference {is} left out");
    }
    if bus.layout.has_reference() && without_reference > 0 {
        tracing::warn!(
            "{file}: {without_reference} of {all} samples have no reference, so the reference is \
            not used"
        );
    }
    let start_ns = start.map(|stamp_ns| i128::from(stamp_ns) + i128::from(since_1970_ns));
    let start = start_ns.and_then(RecordingStart::of_unix_ns);
    Ok(Record { recording_start: start, unused_frames, ..Record::from_segments(parts) })
}

/// Removes the first sample of a piece if only this sample has no reference. A target takes effect
/// at the SYNC after its frame, so the first cycle of a piece has no reference. Without the
/// removal, one sample would cost the complete measurement its reference. If more samples have no
/// reference, none is removed and the measurement has no reference.
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

/// Samples of a log.
struct LogSamples {
    samples: Vec<JointSample>,
    /// Offset to add to their stamps; see
    /// [`since_1970_ns`](didim_drivers::source::Source::since_1970_ns).
    since_1970_ns: i64,
    /// Numbers of unused frames and cycles, by cause.
    unused_frames: BTreeMap<&'static str, u64>,
}

fn read_samples(
    path: &Path,
    bus: &CellBus,
    interfaces: &[InterfaceName],
) -> Result<LogSamples, LogError> {
    let file = || path.to_path_buf();
    let mut identifiers: Vec<FrameId> = Vec::new();
    let configured = bus.interfaces();
    let named = NamedInterfaces { requested: interfaces, configured: &configured };
    let source = open_bus_log(path, &bus.layout, named)?;
    let since_1970_ns = source.since_1970_ns();
    let mut of_log = Samples::new(source, bus.assembler(), BATCH_FRAMES).with_tap(Some(Box::new(
        |frames: &[Frame], _| {
            for frame in frames.iter().filter(|frame| !frame.is_error()) {
                if identifiers.len() < MAX_LISTED_IDS && !identifiers.contains(&frame.id) {
                    identifiers.push(frame.id);
                }
            }
        },
    )));
    // While a vector grows, its old and its new allocation exist at the same time.
    let capacity = Capacity::of_bytes(3 * size_of::<JointSample>());
    let mut samples: Vec<JointSample> = Vec::new();
    for sample in &mut of_log {
        samples.push(sample?);
        if samples.len() > capacity.samples {
            return Err(LogError::TooLong { file: file(), samples: capacity.samples });
        }
    }
    let losses = Box::new(*of_log.losses());
    drop(of_log);
    if samples.is_empty() {
        let expected = bus.layout.messages().iter().map(|message| message.format.id).collect();
        return Err(LogError::NoSample { file: file(), expected, found: identifiers, losses });
    }
    let counts = losses.frames.by_cause().chain(losses.cycles.by_cause());
    let unused_frames: BTreeMap<_, _> = counts.filter(|(_, count)| *count > 0).collect();
    let is_missing = samples.windows(2).any(|pair| pair[1].sequence != pair[0].sequence + 1);
    if is_missing || !unused_frames.is_empty() {
        let missing = if is_missing { "bus cycles are missing; " } else { "" };
        tracing::warn!("{}: {missing}not used, by cause: {}", path.display(), loss_causes(&losses));
    }
    Ok(LogSamples { samples, since_1970_ns, unused_frames })
}

/// Lists the first identifiers, as candump writes them.
fn list(ids: &[FrameId]) -> String {
    let names: Vec<String> = ids.iter().take(MAX_LISTED_IDS).map(ToString::to_string).collect();
    match names.len() {
        0 => "none".to_owned(),
        listed if listed < ids.len() => format!("{} …", names.join(" ")),
        _ => names.join(" "),
    }
}

/// Lists every cause with a count, as `name 12, name 3`.
fn loss_causes(losses: &Losses) -> String {
    let counts = losses.frames.by_cause().chain(losses.cycles.by_cause());
    let counts = counts.filter(|(_, count)| *count > 0);
    let counts: Vec<String> =
        counts.map(|(key, count)| format!("{} {count}", label(key))).collect();
    if counts.is_empty() { "none".to_owned() } else { counts.join(", ") }
}
