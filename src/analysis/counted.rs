//! The samples of a recording that count: its pieces without gaps, less the margins of the filters,
//! checked against the rate of the cell and the limits of the robot.

use std::collections::BTreeMap;
use std::ops::Range;

use didim_dynamics::robot::{JointIndex, Robot};
use didim_formats::{Measurement, Piece, Record, RecordingStart, TimeLimits};

use super::screening::{BeyondLimits, LIMITS_REMEDY, check_limits, open_limits, still_joints};
use crate::cell::Cell;
use crate::live::window_options::WindowOptionError;
use crate::window::DriveReadings;

/// A contiguous piece of a file, and the range of its samples that count.
#[derive(Clone, Debug)]
pub struct CountedPiece {
    /// The piece.
    pub piece: Piece,
    /// Range of its samples that count; the others are margin for the filters.
    pub counted_range: Range<usize>,
    /// Time of the first sample of the file, if it is known.
    pub recording_start: Option<RecordingStart>,
    /// Numbers of unused frames and cycles of the file, by cause; empty except for its first piece.
    pub unused_frames: BTreeMap<&'static str, u64>,
}

/// Error when the samples of a recording cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CountError {
    /// A limit of the samples that count lies outside the recording.
    #[error("--{name} {seconds}: the measurement lasts from 0 to {end_s} s")]
    Outside {
        /// The limit: `from` or `to`.
        name: &'static str,
        /// Its value \[s after the first sample\].
        seconds: f64,
        /// Time of the last sample \[s after the first\].
        end_s: f64,
    },
    /// No sample lies between the limits.
    #[error("--from {from} --to {to}: {}", match segments {
        1 => "there is no sample between them".to_owned(),
        _ => format!("none of {segments} pieces has enough samples between them"),
    })]
    NoneBetween {
        /// The first limit \[s after the first sample\].
        from: f64,
        /// The last limit \[s after the first sample\].
        to: f64,
        /// Number of pieces.
        segments: usize,
    },
    /// Every sample of every piece is margin for the filters.
    #[error(
        "no sample counts: each of the {segments} pieces of {samples} samples is margin for the \
        filters; record without losses"
    )]
    ShortPieces {
        /// Number of pieces.
        segments: usize,
        /// Number of samples of all pieces.
        samples: usize,
    },
    /// Every sample is margin for the filters.
    #[error(
        "no sample counts: of {samples} samples, {before} at the beginning and {after} at the end \
        are margin for the filters; record longer, or choose --from and --to"
    )]
    Short {
        /// Number of samples.
        samples: usize,
        /// Number of samples in the first margin.
        before: usize,
        /// Number of samples in the last margin.
        after: usize,
    },
    /// The rate is not that of the cell. The layout declares the torque delay as a fraction of a
    /// sample, which is valid only at the rate of the cell.
    #[error(
        "the measurement has {found_hz} samples/s, the cell {cell_hz}; choose a cell of the \
        measurement's rate, or resample the measurement"
    )]
    Rate {
        /// Rate of the measurement \[Hz\].
        found_hz: f64,
        /// Rate of the cell \[Hz\].
        cell_hz: f64,
    },
    /// The margins do not fit the rate of the cell.
    #[error(transparent)]
    Windows(#[from] WindowOptionError),
    /// Positions or torques are far beyond the robot's limits.
    #[error(transparent)]
    Limits(#[from] BeyondLimits),
}

/// Checks that a measurement has the sample rate of the cell.
///
/// # Errors
/// [`CountError::Rate`].
pub fn check_cell_rate(measurement: &Measurement, cell: &Cell) -> Result<(), CountError> {
    let (found_hz, cell_hz) = (measurement.signals.sample_rate_hz, cell.sample_rate_hz());
    match (found_hz / cell_hz - 1.0).abs() <= TimeLimits::DEFAULT.same_rate {
        true => Ok(()),
        false => Err(CountError::Rate { found_hz, cell_hz }),
    }
}

/// Returns the pieces of a recording with samples that count, at least one. `from_to` are limits of
/// the samples that count \[s after the first sample\]. Calls `warn` with each warning for the
/// user, also with those that come before an error.
///
/// # Errors
/// [`CountError`].
pub fn count_samples(
    record: Record,
    cell: &Cell,
    from_to: [Option<f64>; 2],
    mut warn: impl FnMut(String),
) -> Result<Vec<CountedPiece>, CountError> {
    record.notes().into_iter().for_each(&mut warn);
    for piece in &record.segments {
        check_cell_rate(&piece.measurement, cell)?;
    }
    let all = record.segments.len();
    let parts = counted_pieces(from_to, cell, record)?;
    if parts.len() < all {
        warn(format!("of {all} pieces {} have samples that count", parts.len()));
    }
    if let Some(open) = open_limits(&cell.robot) {
        warn(format!("{open}; {LIMITS_REMEDY}"));
    }
    for CountedPiece { piece, counted_range: counted, .. } in &parts {
        let limits = cell.screening.limits;
        let beyond = check_limits(&piece.measurement, counted, &cell.robot, limits)?;
        beyond.iter().map(ToString::to_string).for_each(&mut warn);
    }
    let still = still_joints(&measurement_pairs(&parts), cell.screening.rest);
    standstill_text(&still, &cell.robot).into_iter().for_each(&mut warn);
    Ok(parts)
}

impl CountedPiece {
    /// Returns true if another piece has the same signals in its samples that count.
    pub fn has_same_signals(&self, other: &Self) -> bool {
        self.counted_range == other.counted_range
            && self.piece.measurement.signals == other.piece.measurement.signals
    }

    /// Returns the times of the first and the last sample that count \[s after the first of the
    /// file\].
    pub fn times_s(&self) -> [f64; 2] {
        let Self { piece, counted_range: counted, .. } = self;
        [counted.start, counted.end - 1].map(|sample| piece.time_s(sample))
    }

    /// Describes the time range of the samples that count, and the number of samples that are
    /// margin for the filters.
    pub fn counted_text(&self) -> String {
        // Microseconds are enough for people.
        let [from, to] = self.times_s().map(|time_s| (time_s * 1e6).round() / 1e6);
        let margins = self.piece.measurement.samples() - self.counted_range.len();
        format!("counted from {from} s to {to} s; {margins} samples are margin for the filters\n")
    }

    /// Describes the start of the piece, unless it is the start of the file.
    pub fn recording_begin(&self) -> String {
        let begins_s = self.piece.begins_s;
        if begins_s > 0.0 { format!(" from {begins_s:.3} s") } else { String::new() }
    }

    /// Returns the additional readings of the drives in the samples that count.
    pub fn readings(&self) -> DriveReadings {
        let readings = self.piece.readings.iter();
        DriveReadings::from_cycles(
            readings.filter(|(at, _)| self.counted_range.contains(at)).map(|(_, of)| of),
        )
    }
}

/// Returns each measurement with the range of its samples that count, as the identification expects
/// them.
pub fn measurement_pairs<'a>(
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

/// Returns the range of each piece that counts: from `--from` to `--to`, or all but the margins of
/// the cell's windows. Pieces without such samples are left out.
fn counted_pieces(
    [first_s, last_s]: [Option<f64>; 2],
    cell: &Cell,
    record: Record,
) -> Result<Vec<CountedPiece>, CountError> {
    let end_s = record.segments.last().map_or(0.0, Piece::ends_s);
    for (name, seconds) in [("from", first_s), ("to", last_s)] {
        // Half a sample is tolerated, because the user may enter a displayed time, which is
        // rounded.
        let last_s = end_s + 0.5 / cell.sample_rate_hz();
        if let Some(seconds) = seconds.filter(|seconds| !(0.0..=last_s).contains(seconds)) {
            return Err(CountError::Outside { name, seconds, end_s });
        }
    }
    let margins = cell.window.plan(cell.sample_rate_hz())?;
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
    if counted.is_empty() {
        return Err(match (first_s, last_s, parts) {
            (Some(from), Some(to), segments) => CountError::NoneBetween { from, to, segments },
            (_, _, 1) => {
                let (before, after) = (first.start, samples.saturating_sub(first.end));
                CountError::Short { samples, before, after }
            }
            (_, _, segments) => CountError::ShortPieces { segments, samples },
        });
    }
    Ok(counted)
}
