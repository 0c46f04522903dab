//! Information about each parameter by part of the motion.

use core::ops::Range;

use crate::identification::observation::Motion;
use crate::regression::{Observations, ResidualAnalysis};

/// Share of its highest speed below which a joint is at rest. The arm rests if all joints are at
/// rest.
const REST_SPEED_SHARE: f64 = 0.02;

/// Smallest number of rows of a move. A shorter move is merged with the next one, a short last move
/// with the one before.
const MIN_ROWS: usize = 5;

/// Largest number of moves. A motion without rests, or with more moves, is divided into
/// `MOTION_SLICES` slices of equal length.
const MAX_MOVES: usize = 30;
const MOTION_SLICES: usize = 10;

/// Share of the information about each parameter that comes from each move.
///
/// The standard deviation of a parameter is `1/‖z‖`. Here z is the part of its column of Ω^(−1/2) X
/// that is orthogonal to all other columns, because only this part distinguishes the parameter. So
/// the share of a move in the classical information 1/σ² is the sum of squares of z over its rows,
/// divided by ‖z‖².
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Information {
    /// Start and end of each move since the first sample \[s\].
    pub moves_s: Vec<Range<f64>>,
    /// True if the moves lie between rests; otherwise they are slices of equal length.
    pub between_rests: bool,
    /// Shares of each parameter, one per move; they add up to 1.
    pub shares: Vec<Vec<f64>>,
}

impl Information {
    /// `samples` are the samples of one joint's rows.
    pub(crate) fn new(
        observations: &Observations,
        analysis: &ResidualAnalysis<'_>,
        noise_levels: &[f64],
        motion: &Motion,
        samples: &[usize],
        sample_rate_hz: f64,
    ) -> Self {
        let (between_rests, moves) = find_moves(motion, samples);
        // z_k/‖z_k‖² = Ω^(1/2) times the influence on parameter k.
        let mut squares = vec![vec![0.0; moves.len()]; observations.matrix().ncols()];
        for (joint, level) in noise_levels.iter().enumerate() {
            for (at, rows) in moves.iter().enumerate() {
                let influence = analysis.influence(joint, rows.clone());
                for (squares, own) in squares.iter_mut().zip(influence.column_iter()) {
                    squares[at] += own.norm_squared() * level * level;
                }
            }
        }
        let shares = squares.into_iter().map(|squares| {
            let total: f64 = squares.iter().sum();
            squares.iter().map(|square| square / total).collect()
        });
        let time_s = |row: usize| samples.get(row).map_or(0.0, |&k| k as f64 / sample_rate_hz);
        let last = samples.len().saturating_sub(1);
        Self {
            moves_s: moves.iter().map(|m| time_s(m.start)..time_s(m.end.min(last))).collect(),
            between_rests,
            shares: shares.collect(),
        }
    }
}

/// Returns true if rests separate the moves, and the rows of each move.
fn find_moves(motion: &Motion, samples: &[usize]) -> (bool, Vec<Range<usize>>) {
    let (Some(&first), Some(&last)) = (samples.first(), samples.last()) else {
        return (false, Vec::new());
    };
    let speed = |k: usize, joint: usize| motion.velocity(k, joint).abs();
    let highest = |joint: usize| (first..=last).map(|k| speed(k, joint)).fold(0.0, f64::max);
    let highest: Vec<f64> = (0..motion.position.ncols()).map(highest).collect();
    let rests = |k: usize| {
        highest.iter().enumerate().all(|(joint, most)| speed(k, joint) <= REST_SPEED_SHARE * most)
    };
    // The middle of each rest separates two moves.
    let mut ends = Vec::new();
    let mut begun = None;
    for k in first..=last {
        match (rests(k), begun) {
            (true, None) => begun = Some(k),
            // The rest before the first move does not end a move.
            (false, Some(begin)) => {
                if begin > first {
                    let middle = usize::midpoint(begin, k);
                    ends.push(samples.partition_point(|&sample| sample < middle));
                }
                begun = None;
            }
            _ => {}
        }
    }
    let mut moves: Vec<Range<usize>> = Vec::new();
    let mut start = 0;
    for end in ends.into_iter().chain([samples.len()]) {
        if end - start >= MIN_ROWS {
            moves.push(start..end);
            start = end;
        }
    }
    if let Some(last) = moves.last_mut() {
        last.end = samples.len();
    }
    if (2..=MAX_MOVES).contains(&moves.len()) {
        return (true, moves);
    }
    let slices = MOTION_SLICES.min(samples.len());
    let slice_begin = |slice: usize| slice * samples.len() / slices;
    (false, (0..slices).map(|slice| slice_begin(slice)..slice_begin(slice + 1)).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::regression::RowFilter;

    /// Returns the motion of two joints: three moves of 0.5 s with rests of 0.1 s between them.
    /// Joint 2 moves only in the second.
    fn motion() -> Motion {
        let velocity = DMatrix::from_fn(1800, 2, |k, joint| {
            let (number, at) = (k / 600, k % 600);
            let moving = at < 500 && (joint == 0 || number == 1);
            if moving { (at as f64 / 500.0 * core::f64::consts::PI).sin() } else { 0.0 }
        });
        Motion::from_matrices(velocity.clone(), velocity.clone(), velocity)
    }

    #[test]
    fn moves_lie_between_rests() {
        let samples: Vec<usize> = (0..1800).step_by(10).collect();
        let (between_rests, found) = find_moves(&motion(), &samples);
        assert!(between_rests);
        // Rests from 50 to 60 and from 110 to 120, slightly wider because of the speed limit.
        assert_eq!(found.len(), 3, "{found:?}");
        assert!(found[0].end.abs_diff(55) <= 1 && found[1].end.abs_diff(115) <= 1, "{found:?}");
        assert_eq!((found[0].start, found[2].end), (0, 180));
    }

    /// A rest of half a second before the first move belongs to that move, and one after the last
    /// move to the last.
    #[test]
    fn a_rest_is_no_move() {
        let Motion { position: moves_alone, .. } = motion();
        let velocity = DMatrix::from_fn(2800, 2, |k, joint| match k.checked_sub(500) {
            Some(k) if k < 1800 => moves_alone[(k, joint)],
            _ => 0.0,
        });
        let motion = Motion::from_matrices(velocity.clone(), velocity.clone(), velocity);
        let samples: Vec<usize> = (0..2800).step_by(10).collect();
        let (between_rests, found) = find_moves(&motion, &samples);
        assert!(between_rests);
        assert_eq!(found.len(), 3, "{found:?}");
        assert_eq!((found[0].start, found[2].end), (0, 280));
    }

    #[test]
    fn a_motion_without_rests_is_sliced() {
        let velocity =
            DMatrix::from_fn(1000, 2, |k, joint| (k as f64 / 50.0 + joint as f64 * 1.5).sin());
        let motion = Motion::from_matrices(velocity.clone(), velocity.clone(), velocity);
        let samples: Vec<usize> = (0..1000).step_by(10).collect();
        let (between_rests, found) = find_moves(&motion, &samples);
        assert!(!between_rests);
        assert_eq!(found.len(), MOTION_SLICES);
        assert!(found.windows(2).all(|pair| pair[0].end == pair[1].start));
    }

    /// The rows where its column differs from all others determine a parameter. Without these rows
    /// 1/σ² decreases by their share, and by more, because z changes too.
    #[test]
    fn shares_are_those_of_the_information() {
        let rows = 180;
        let samples: Vec<usize> = (0..1800).step_by(10).collect();
        // Column 0 is in joint 1 throughout. Column 1 is in joint 2, only in the second move.
        let x = DMatrix::from_fn(2 * rows, 2, |row, column| {
            let (joint, row) = (row / rows, row % rows);
            let t = row as f64 * 0.37;
            match (joint, column) {
                (0, 0) => 1.0 + 0.2 * t.sin(),
                (1, 1) if (60..110).contains(&row) => t.cos(),
                _ => 0.0,
            }
        });
        let y = &x * DVector::from_element(2, 1.0)
            + DVector::from_fn(2 * rows, |k, _| ((k * k * 53 + 11 * k) % 307) as f64 / 307.0 - 0.5);
        let observations = Observations::new(x, y, 2).unwrap();
        let levels = [0.3, 2.0];
        let solution = observations.solve_weighted(&levels).unwrap();
        let filter = RowFilter::new(rows, 1.0, |_| 1.0);
        let analysis = ResidualAnalysis::new(&observations, &solution, &filter);
        let information =
            Information::new(&observations, &analysis, &levels, &motion(), &samples, 1000.0);
        assert_eq!(information.shares.len(), 2);
        for shares in &information.shares {
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        // A third each, and one move alone.
        assert!(
            information.shares[0].iter().all(|share| (share - 1.0 / 3.0).abs() < 0.05),
            "{information:?}"
        );
        assert!((information.shares[1][1] - 1.0).abs() < 1e-12, "{information:?}");
        // Only joint 1 identifies column 0. The share is the sum of squares of its entries,
        // relative to the total.
        let dense = observations.matrix().dense();
        let column = dense.column(0);
        let square = |rows: Range<usize>| column.rows_range(rows).norm_squared();
        let first = find_moves(&motion(), &samples).1[0].clone();
        let expected = square(first) / square(0..2 * rows);
        assert!((information.shares[0][0] - expected).abs() < 1e-12);
        assert!(
            information.moves_s[1].start > 0.54 && information.moves_s[1].end < 1.16,
            "{information:?}"
        );
    }
}
