//! From stamps that jitter to a uniform grid.

use core::fmt;
use std::path::Path;

use super::error::BagError;
use super::spec::{BagSpec, BagTime};

/// Messages that are further apart than so many periods have lost some between them.
const GAP: f64 = 2.5;
/// The rate may be off by so much where the stamps tell it: what is resampled has the times of the stamps.
const RATE: f64 = 0.2;
/// Stamps this near are on the grid \[s\].
const ON_GRID_S: f64 = 1e-6;
/// A cubic takes four points.
const LEAST: usize = 4;

/// A state of all joints.
pub(super) struct Row {
    pub(super) time_ns: u64,
    /// Positions, then efforts.
    pub(super) values: Vec<f64>,
}

/// What had to be done to messages for a uniform grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resampled {
    /// How far the stamps were off the grid: root mean square \[s\].
    pub rms_s: f64,
    /// At most \[s\].
    pub largest_s: f64,
    /// Messages that said again what the one before did.
    pub repeated: usize,
    /// Pieces between losses; the longest one counts.
    pub pieces: usize,
    /// When that begins, after the first message \[s\].
    pub begins_s: f64,
    /// How long it lasts \[s\].
    pub lasts_s: f64,
}

impl Resampled {
    /// Whether the messages were on the grid, all of them.
    pub fn is_nothing(&self) -> bool {
        self.largest_s < ON_GRID_S && self.repeated == 0 && self.pieces <= 1
    }
}

impl fmt::Display for Resampled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rms, largest) = (1e3 * self.rms_s, 1e3 * self.largest_s);
        write!(
            f,
            "stamps are {rms:.3} ms off a uniform grid in the root mean square, {largest:.3} ms at most, and are resampled"
        )?;
        if self.repeated > 0 {
            write!(f, "; {} messages repeat the one before and are left out", self.repeated)?;
        }
        if self.pieces > 1 {
            let (pieces, begins, lasts) = (self.pieces, self.begins_s, self.lasts_s);
            write!(
                f,
                "; messages are missing: of {pieces} pieces the longest counts, {lasts:.3} s from {begins:.3} s on"
            )?;
        }
        Ok(())
    }
}

/// The columns of the longest whole piece on a grid of the stated rate, by cubics through the four nearest messages.
pub(super) fn resample(
    path: &Path,
    mut rows: Vec<Row>,
    spec: &BagSpec,
) -> Result<(Vec<Vec<f64>>, Resampled), BagError> {
    let file = || path.to_path_buf();
    let too_short = || BagError::TooShort { file: file(), least: LEAST };
    let mut resampled = Resampled::default();
    let width = 2 * spec.joints.len();
    let period_s = 1.0 / spec.rate_hz;
    if spec.time == BagTime::Rows {
        #[expect(clippy::cast_precision_loss, reason = "at most MAX_SAMPLES")]
        let lasts_s = rows.len() as f64 * period_s;
        resampled = Resampled { pieces: 1, lasts_s, ..resampled };
        let columns = (0..width).map(|k| rows.iter().map(|row| row.values[k]).collect());
        return if rows.len() < LEAST {
            Err(too_short())
        } else {
            Ok((columns.collect(), resampled))
        };
    }
    let first_ns = rows.first().map_or(0, |row| row.time_ns);
    #[expect(clippy::cast_precision_loss, reason = "times after the first")]
    let seconds = |time_ns: u64| time_ns.saturating_sub(first_ns) as f64 * 1e-9;
    if rows.len() > 1 && rows.iter().all(|row| row.time_ns == first_ns) {
        return Err(BagError::NoTime { file: file() });
    }
    let before = rows.len();
    rows.dedup_by(|later, earlier| {
        later.time_ns == earlier.time_ns && later.values == earlier.values
    });
    resampled.repeated = before - rows.len();
    if let Some(pair) = rows.windows(2).find(|pair| pair[1].time_ns <= pair[0].time_ns) {
        return Err(BagError::Backwards { file: file(), time_s: seconds(pair[1].time_ns) });
    }
    let times: Vec<f64> = rows.iter().map(|row| seconds(row.time_ns)).collect();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return Err(too_short());
    }
    let whole = |step: &f64| *step <= GAP * period_s;
    // The longest piece without a gap.
    let (mut longest, mut begin) = (0..0, 0);
    for end in 1..=times.len() {
        if end == times.len() || !whole(&steps[end - 1]) {
            resampled.pieces += 1;
            if end - begin > longest.len() {
                longest = begin..end;
            }
            begin = end;
        }
    }
    steps.sort_unstable_by(f64::total_cmp);
    let found_hz = 1.0 / steps[steps.len() / 2];
    if (found_hz / spec.rate_hz - 1.0).abs() > RATE {
        return Err(BagError::Rate { file: file(), found_hz, stated_hz: spec.rate_hz });
    }
    if longest.len() < LEAST {
        return Err(too_short());
    }
    let (times, rows) = (&times[longest.clone()], &rows[longest]);
    let (start, end) = (times[0], times[times.len() - 1]);
    (resampled.begins_s, resampled.lasts_s) = (start, end - start);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most MAX_SAMPLES"
    )]
    let count = ((end - start) / period_s + 1e-6).floor() as usize + 1;
    let mut columns = vec![Vec::with_capacity(count); width];
    let (mut at, mut squares) = (0, 0.0);
    for k in 0..count {
        #[expect(clippy::cast_precision_loss, reason = "at most MAX_SAMPLES")]
        let time = start + k as f64 * period_s;
        while at + 2 < times.len() && times[at + 1] <= time {
            at += 1;
        }
        let off = (times[at] - time).abs().min((times[at + 1] - time).abs());
        squares += off * off;
        resampled.largest_s = resampled.largest_s.max(off);
        let from = at.saturating_sub(1).min(times.len() - LEAST);
        let weights = cubic(&times[from..from + LEAST], time);
        for (column, k) in columns.iter_mut().zip(0..) {
            let near = rows[from..from + LEAST].iter().zip(weights);
            column
                .push(near.map(|(row, weight): (&Row, f64)| weight * row.values[k as usize]).sum());
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "at most MAX_SAMPLES")]
    let mean = squares / count as f64;
    resampled.rms_s = mean.sqrt();
    Ok((columns, resampled))
}

/// The weights of four points in the cubic through them (Lagrange).
fn cubic(times: &[f64], time: f64) -> [f64; LEAST] {
    core::array::from_fn(|k| {
        let others = times.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, other)| (time - other) / (times[k] - other)).product()
    })
}
