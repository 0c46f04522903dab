//! Folds of the motion for cross-validation. Repeated motion belongs to the same fold.

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
/// `SAME_STATE_STEP_SHARE` of its change between rows, and a share of its standard deviation along
/// the motion (`REPEATABLE_SHARES`, for positions and speeds).
const SAME_STATE_STEP_SHARE: f64 = 0.6;
const REPEATABLE_SHARES: [f64; 2] = [0.02, 0.05];

/// Largest distance of rows that belong to the same passage through a state.
const PASSAGE_ROWS: usize = 25;

/// Largest cell number; higher ones are limited to it.
const MAX_CELL_NUMBER: f64 = 1e15;

/// Share of its highest speed above which a joint is moving.
const MOVING_SHARE: f64 = 0.1;

/// Motion split into folds of equal length. Repeated motion counts once.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Folds {
    /// Fold of each row of a joint.
    pub(super) fold_of_row: Vec<usize>,
    /// First row with the same state, for each row.
    first_equal_row: Vec<usize>,
    /// Number of folds.
    pub(super) count: usize,
    /// Number of rows that differ from all earlier rows.
    pub(super) distinct_rows: usize,
    /// Mean number of times that the arm repeats a state, over the rows where it moves.
    pub(super) mean_repeats: f64,
}

impl Folds {
    /// Splits the rows of a context into folds: by recording if there are enough different
    /// recordings, otherwise into parts of equal length.
    pub(super) fn from_context(context: &Context<'_>, motion: &Motion) -> Self {
        let cut = Self::new(motion, &context.samples, context.rows_hz());
        let recording = |row: usize| context.experiment.recording_of(context.samples[row]);
        // Repeated motion belongs to the recording where it first occurred.
        let of_row: Vec<usize> = cut.first_equal_row.iter().map(|&row| recording(row)).collect();
        let mut recordings = of_row.clone();
        recordings.sort_unstable();
        recordings.dedup();
        if recordings.len() < MIN_RECORDINGS {
            return cut;
        }
        let count = recordings.len().min(MAX_FOLDS);
        let number = |of: usize| recordings.partition_point(|before| *before < of) % count;
        Self { fold_of_row: of_row.into_iter().map(number).collect(), count, ..cut }
    }

    /// Splits rows into parts of equal length. `samples` are the samples of the rows, `rows_hz` is
    /// the number of rows per second.
    pub(super) fn new(motion: &Motion, samples: &[usize], rows_hz: f64) -> Self {
        let states = States::new(motion, samples, rows_hz);
        let mut cells: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        // For each row the first row with the same state, as an index into `firsts`.
        let (mut firsts, mut like) = (Vec::new(), Vec::with_capacity(samples.len()));
        let (mut moving, mut moving_first) = (0.0, 0.0);
        for row in 0..samples.len() {
            let [a, b] = states.cell_of_row(row);
            let around = (a - 1..=a + 1).flat_map(|a| (b - 1..=b + 1).map(move |b| [a, b]));
            let before = around.filter_map(|cell| cells.get(&cell)).flatten().copied();
            let matching = before.filter(|&first| {
                row - firsts[first] > PASSAGE_ROWS && states.is_same_state(firsts[first], row)
            });
            let match_of = matching.min();
            if states.is_moving(row) {
                moving += 1.0;
                moving_first += if match_of.is_none() { 1.0 } else { 0.0 };
            }
            like.push(match_of.unwrap_or_else(|| {
                cells.entry([a, b]).or_default().push(firsts.len());
                firsts.push(row);
                firsts.len() - 1
            }));
        }
        let distinct = firsts.len();
        let of_row = like.iter().map(|first| first * FOLD_COUNT / distinct.max(1)).collect();
        let first_like = like.into_iter().map(|first| firsts[first]).collect();
        let repeat_count =
            if moving_first > 0.0 { f64::max(moving / moving_first, 1.0) } else { 1.0 };
        Self {
            fold_of_row: of_row,
            first_equal_row: first_like,
            count: FOLD_COUNT,
            distinct_rows: distinct,
            mean_repeats: repeat_count,
        }
    }
}

/// Positions and speeds at the rows.
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
    fn new(motion: &Motion, samples: &[usize], rows_hz: f64) -> Self {
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
                        .map(|rate| SAME_STATE_STEP_SHARE * rate.abs() / rows_hz + repeatable),
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

    fn is_moving(&self, row: usize) -> bool {
        self.moving_joints[row]
    }

    fn is_same_state(&self, a: usize, b: usize) -> bool {
        (0..self.values.ncols()).all(|column| {
            let distance = self.values[(a, column)] - self.values[(b, column)];
            distance.abs() <= self.tolerances[(b, column)]
        })
    }

    /// Returns the cell of a row. Equal states are in the same cell or in an adjacent one.
    fn cell_of_row(&self, row: usize) -> [i64; 2] {
        self.finest_columns.map(|column| {
            let widest = self.largest_tolerances[column];
            #[expect(clippy::cast_possible_truncation, reason = "casts saturate, and far inside")]
            let cell = (self.values[(row, column)] / widest)
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
    fn what_recurs_is_the_same_piece() {
        let once: Vec<usize> = (0..500).collect();
        let alone = Folds::new(&motion(500, 500), &once, 100.0);
        assert!(alone.distinct_rows > 450 && alone.mean_repeats < 1.1, "{alone:?}");
        let thrice: Vec<usize> = (0..1500).collect();
        let again = Folds::new(&motion(1500, 500), &thrice, 100.0);
        assert_eq!(again.distinct_rows, alone.distinct_rows);
        assert_eq!(again.fold_of_row[..500], alone.fold_of_row[..]);
        assert_eq!(again.fold_of_row[500..1000], again.fold_of_row[1000..]);
        assert!(
            (again.mean_repeats / alone.mean_repeats - 3.0).abs() < 1e-12,
            "{}",
            again.mean_repeats
        );
    }

    #[test]
    fn a_motion_that_never_returns_is_cut_into_equal_parts() {
        let samples: Vec<usize> = (0..1000).collect();
        let position = DMatrix::from_fn(1000, 2, |k, _| k as f64);
        let velocity = DMatrix::from_element(1000, 2, 1.0);
        let acceleration = DMatrix::zeros(1000, 2);
        let motion = Motion::from_matrices(position, velocity, acceleration);
        let folds = Folds::new(&motion, &samples, 1.0);
        assert_eq!((folds.distinct_rows, folds.mean_repeats), (1000, 1.0));
        assert!(folds.fold_of_row.iter().enumerate().all(|(row, piece)| *piece == row / 200));
    }
}
