//! Folds of the motion for cross-validation. Repeated motion belongs to the same fold.

use core::ops::Range;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::identification::observation::Motion;
use crate::identification::problem::Context;

/// Number of folds of a motion with too few different recordings.
const FOLD_COUNT: usize = 5;

/// Smallest number of recordings for which each recording is a fold. With only two, each one alone
/// would have to identify all parameters.
const MIN_RECORDINGS: usize = 3;

/// Largest number of folds. More recordings share them.
const MAX_FOLDS: usize = 32;

/// Two states are the same if every position and speed agrees within the sum of two tolerances:
/// `SAME_STATE_STEP_SHARE` of its change between instants, and a share of its standard deviation
/// along the motion (`REPEATABLE_SHARES`, for positions and speeds).
const SAME_STATE_STEP_SHARE: f64 = 0.6;
const REPEATABLE_SHARES: [f64; 2] = [0.02, 0.05];

/// Time between the instants at which states are compared \[s\], if the sample rate allows. It does
/// not depend on the decimation.
const INSTANT_S: f64 = 0.04;

/// Longest time between instants that belong to the same passage through a state \[s\].
const PASSAGE_S: f64 = 1.0;

/// Largest cell number; higher ones are limited to it.
const MAX_CELL_NUMBER: f64 = 1e15;

/// Share of its highest speed above which a joint is moving.
const MOVING_SHARE: f64 = 0.1;

/// Motion split into folds of equal length. Repeated motion counts once.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Folds {
    /// Fold of each row of a joint.
    pub(super) fold_of_row: Vec<usize>,
    /// Rows of each recording.
    pub(super) recordings: Vec<Range<usize>>,
    /// Number of folds.
    pub(super) count: usize,
    /// Duration of the motion without repetitions \[s\].
    pub(super) distinct_s: f64,
    /// Mean number of times that the arm repeats a state, over the time when it moves.
    pub(super) mean_repeats: f64,
}

impl Folds {
    /// Splits the rows of a context into folds: by recording if there are enough different
    /// recordings, otherwise into parts of equal length.
    pub(super) fn from_context(context: &Context<'_>, motion: &Motion) -> Self {
        let instants = instants(context);
        let repetitions = Repetitions::new(motion, &instants, context.experiment.sample_rate_hz());
        let recording = |instant: &usize| context.experiment.recording_of(instants[*instant]);
        // Repeated motion belongs to the recording where it first occurred.
        let recording_of: Vec<usize> = repetitions.first_equal.iter().map(recording).collect();
        let mut recordings = recording_of.clone();
        recordings.sort_unstable();
        recordings.dedup();
        let (count, fold_of_instant) = if recordings.len() < MIN_RECORDINGS {
            repetitions.equal_parts()
        } else {
            let count = recordings.len().min(MAX_FOLDS);
            let number = |of: usize| recordings.partition_point(|before| *before < of) % count;
            (count, recording_of.into_iter().map(number).collect())
        };
        // The first instant of a recording is its first counted sample.
        let before = |sample: &usize| instants.partition_point(|of| of <= sample).max(1) - 1;
        let of_row = |sample: &usize| fold_of_instant[before(sample)];
        let recording_of = |sample: &usize| context.experiment.recording_of(*sample);
        let mut recordings = Vec::new();
        let mut first = 0;
        for rows in context.samples.chunk_by(|a, b| recording_of(a) == recording_of(b)) {
            recordings.push(first..first + rows.len());
            first += rows.len();
        }
        Self {
            recordings,
            fold_of_row: context.samples.iter().map(of_row).collect(),
            count,
            distinct_s: repetitions.distinct_s(),
            mean_repeats: repetitions.mean_repeats,
        }
    }
}

/// Returns the samples at which states are compared: those that count, [`INSTANT_S`] apart.
fn instants(context: &Context<'_>) -> Vec<usize> {
    let experiment = context.experiment;
    let step = samples_per_instant(experiment.sample_rate_hz());
    let counted = experiment.recordings().iter().map(|of| of.counted_samples.clone());
    counted
        .flat_map(|samples| samples.step_by(step))
        .filter(|sample| !experiment.is_held_out(*sample))
        .collect()
}

/// Returns the number of samples from one instant to the next.
fn samples_per_instant(sample_rate_hz: f64) -> usize {
    samples_within(INSTANT_S, sample_rate_hz).max(1)
}

/// Returns the number of samples in a time, rounded.
pub(crate) fn samples_within(time_s: f64, sample_rate_hz: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "above 0, and casts saturate"
    )]
    let samples = (time_s * sample_rate_hz).round() as usize;
    samples
}

/// Repetitions of states among the instants of a motion.
#[derive(Clone, Debug, PartialEq)]
struct Repetitions {
    /// First instant with the same state, for each instant.
    first_equal: Vec<usize>,
    /// Number of instants that differ from all earlier ones, up to and including each instant.
    distinct_until: Vec<usize>,
    /// Time between instants \[s\].
    period_s: f64,
    /// Mean number of times that the arm repeats a state, over the time when it moves.
    mean_repeats: f64,
}

impl Repetitions {
    /// Compares the states at all instants, which are samples of the motion.
    fn new(motion: &Motion, instants: &[usize], sample_rate_hz: f64) -> Self {
        let step = samples_per_instant(sample_rate_hz);
        let period_s = step as f64 / sample_rate_hz;
        let passage = samples_within(PASSAGE_S, sample_rate_hz) / step;
        let states = States::new(motion, instants, period_s);
        let mut cells: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        let mut first_equal = Vec::with_capacity(instants.len());
        let mut distinct_until = Vec::with_capacity(instants.len());
        let (mut distinct, mut moving, mut moving_first) = (0, 0.0, 0.0);
        for instant in 0..instants.len() {
            let [a, b] = states.cell_of_instant(instant);
            let around = (a - 1..=a + 1).flat_map(|a| (b - 1..=b + 1).map(move |b| [a, b]));
            let before = around.filter_map(|cell| cells.get(&cell)).flatten().copied();
            let matching = before
                .filter(|&first| instant - first > passage && states.is_same_state(first, instant));
            let match_of = matching.min();
            if states.is_moving(instant) {
                moving += 1.0;
                moving_first += if match_of.is_none() { 1.0 } else { 0.0 };
            }
            if match_of.is_none() {
                cells.entry([a, b]).or_default().push(instant);
                distinct += 1;
            }
            first_equal.push(match_of.unwrap_or(instant));
            distinct_until.push(distinct);
        }
        let mean_repeats =
            if moving_first > 0.0 { f64::max(moving / moving_first, 1.0) } else { 1.0 };
        Self { first_equal, distinct_until, period_s, mean_repeats }
    }

    /// Returns the duration of the motion without repetitions \[s\].
    fn distinct_s(&self) -> f64 {
        self.distinct_until.last().map_or(0.0, |count| *count as f64 * self.period_s)
    }

    /// Returns the number of folds and the fold of each instant. The distinct instants are split
    /// into parts of equal length.
    fn equal_parts(&self) -> (usize, Vec<usize>) {
        let distinct = self.distinct_until.last().copied().unwrap_or_default();
        let part = |first: &usize| (self.distinct_until[*first] - 1) * FOLD_COUNT / distinct;
        (FOLD_COUNT, self.first_equal.iter().map(part).collect())
    }
}

/// Positions and speeds at the instants.
struct States {
    /// One column for each position and speed.
    values: DMatrix<f64>,
    /// Distance within which two values count as equal, in the same columns.
    tolerances: DMatrix<f64>,
    /// Largest tolerance of each column.
    largest_tolerances: Vec<f64>,
    /// The two columns that distinguish the most states.
    finest_columns: [usize; 2],
    moving_joints: Vec<bool>,
}

impl States {
    fn new(motion: &Motion, samples: &[usize], period_s: f64) -> Self {
        let (rows, joints) = (samples.len(), motion.position.ncols());
        let mut moving = vec![false; rows];
        let (mut values, mut reach) = (Vec::new(), Vec::new());
        for joint in 0..joints {
            let values_of = |value: &dyn Fn(usize) -> f64| -> DVector<f64> {
                DVector::from_iterator(rows, samples.iter().map(|&k| value(k)))
            };
            let signals = [
                values_of(&|k| motion.position[(k, joint)]),
                values_of(&|k| motion.velocity(k, joint)),
                values_of(&|k| motion.acceleration(k, joint)),
            ];
            let highest = signals[1].amax();
            for (moving, speed) in moving.iter_mut().zip(&signals[1]) {
                *moving |= speed.abs() > MOVING_SHARE * highest;
            }
            for (k, share) in REPEATABLE_SHARES.into_iter().enumerate() {
                let repeatable = share * signals[k].variance().sqrt();
                reach.push(
                    signals[k + 1]
                        .map(|rate| SAME_STATE_STEP_SHARE * rate.abs() * period_s + repeatable),
                );
            }
            let [position, velocity, _] = signals;
            values.extend([position, velocity]);
        }
        let widest: Vec<f64> = reach.iter().map(DVector::max).collect();
        let [values, reach] = [values, reach].map(|columns| DMatrix::from_columns(&columns));
        let cells = |column: usize| {
            let range = values.column(column);
            if widest[column] > 0.0 { (range.max() - range.min()) / widest[column] } else { 0.0 }
        };
        let mut columns: Vec<usize> = (0..values.ncols()).collect();
        columns.sort_by(|&a, &b| cells(b).total_cmp(&cells(a)));
        let finest = [columns[0], columns[1]];
        Self {
            values,
            tolerances: reach,
            largest_tolerances: widest,
            finest_columns: finest,
            moving_joints: moving,
        }
    }

    fn is_moving(&self, instant: usize) -> bool {
        self.moving_joints[instant]
    }

    fn is_same_state(&self, a: usize, b: usize) -> bool {
        (0..self.values.ncols()).all(|column| {
            let distance = self.values[(a, column)] - self.values[(b, column)];
            distance.abs() <= self.tolerances[(b, column)]
        })
    }

    /// Returns the cell of an instant. Equal states are in the same cell or in an adjacent one.
    fn cell_of_instant(&self, instant: usize) -> [i64; 2] {
        self.finest_columns.map(|column| {
            let widest = self.largest_tolerances[column];
            #[expect(clippy::cast_possible_truncation, reason = "casts saturate, and far inside")]
            let cell = (self.values[(instant, column)] / widest)
                .floor()
                .clamp(-MAX_CELL_NUMBER, MAX_CELL_NUMBER) as i64;
            // All values of a constant column are in the same cell.
            if widest > 0.0 { cell } else { 0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a motion of two joints on sums of sines, repeated after `period` samples.
    fn motion(samples: usize, period: usize) -> Motion {
        let position_at = |k: usize, joint: usize| {
            let t = (k % period) as f64 / 100.0;
            (1..4).map(|n| (t * (f64::from(n) * 1.7 + joint as f64) + f64::from(n)).sin()).sum()
        };
        let position = DMatrix::from_fn(samples, 2, position_at);
        let velocity = DMatrix::from_fn(samples, 2, |k, joint| {
            (position_at((k + 1) % period, joint) - position_at(k % period, joint)) * 100.0
        });
        let acceleration = velocity.map(|speed: f64| 3.0 * speed.abs());
        Motion::from_matrices(position, velocity, acceleration)
    }

    #[test]
    fn repeated_motion_is_found_once() {
        let once: Vec<usize> = (0..500).collect();
        let alone = Repetitions::new(&motion(500, 500), &once, 25.0);
        assert!(alone.distinct_s() > 18.0 && alone.mean_repeats < 1.1, "{alone:?}");
        let thrice: Vec<usize> = (0..1500).collect();
        let again = Repetitions::new(&motion(1500, 500), &thrice, 25.0);
        assert!((again.distinct_s() - alone.distinct_s()).abs() < 1e-12);
        let (parts, parts_again) = (alone.equal_parts().1, again.equal_parts().1);
        assert_eq!(parts_again[..500], parts[..]);
        assert_eq!(parts_again[500..1000], parts_again[1000..]);
        assert!((again.mean_repeats / alone.mean_repeats - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_motion_that_never_returns_is_cut_into_equal_parts() {
        let samples: Vec<usize> = (0..1000).collect();
        let position = DMatrix::from_fn(1000, 2, |k, _| k as f64);
        let velocity = DMatrix::from_element(1000, 2, 1.0);
        let motion = Motion::from_matrices(position, velocity, DMatrix::zeros(1000, 2));
        let repetitions = Repetitions::new(&motion, &samples, 25.0);
        assert!((repetitions.mean_repeats - 1.0).abs() < 1e-12);
        assert!((repetitions.distinct_s() - 40.0).abs() < 1e-12);
        let (count, parts) = repetitions.equal_parts();
        assert_eq!(count, FOLD_COUNT);
        assert!(parts.iter().enumerate().all(|(instant, part)| *part == instant / 200));
    }
}
