//! Sequences of random moves: candidates for an exciting trajectory.

use crate::robot::JointIndex;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use serde::{Deserialize, Serialize};

use super::{JointLimits, Move, MoveSequence, TrajectoryError};

/// A generator of random move sequences. The same data give the same sequence on every machine:
/// ChaCha is defined bit by bit and the versions are locked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomMoves {
    /// Seed of the random sequence.
    pub seed: u64,
    /// Number of moves, at least two; the last leads back to the start.
    pub moves: usize,
    /// Part of each joint's range, around its middle, that targets are drawn from: 0 to 1.
    pub range_fraction: f64,
    /// Largest distance of each joint in one move \[rad\].
    pub reach_rad: Vec<f64>,
    /// Largest part of the velocity limits of a move, 0 to 1; the smallest is half of it.
    pub velocity_fraction: f64,
    /// Largest part of the acceleration limits of a move, 0 to 1; the smallest is half of it.
    pub acceleration_fraction: f64,
    /// Dwell after every move \[s\].
    pub dwell_s: f64,
}

impl RandomMoves {
    /// Draws a sequence for an arm with the given limits, starting in the middle of its range.
    /// Fast and slow moves alternate by chance, so that inertial, viscous and dry-friction torques
    /// do not always appear in the same proportion.
    ///
    /// # Errors
    /// [`TrajectoryError`] when a field or a limit makes no sense.
    pub fn draw_sequence(&self, limits: &[JointLimits]) -> Result<MoveSequence, TrajectoryError> {
        limits.iter().enumerate().try_for_each(|(j, limit)| limit.validate(JointIndex::new(j)))?;
        let bad = |key, expected| TrajectoryError::BadGenerator { key, expected };
        if self.moves < 2 {
            return Err(bad("moves", "at least 2"));
        }
        if self.reach_rad.len() != limits.len() {
            return Err(bad("reach_rad", "one value per joint"));
        }
        if !self.reach_rad.iter().all(|reach| reach.is_finite() && *reach > 0.0) {
            return Err(bad("reach_rad", "finite and positive"));
        }
        for (key, value) in [
            ("range_fraction", self.range_fraction),
            ("velocity_fraction", self.velocity_fraction),
            ("acceleration_fraction", self.acceleration_fraction),
        ] {
            if !(value > 0.0 && value <= 1.0) {
                return Err(bad(key, "above 0 and at most 1"));
            }
        }
        let unit =
            Uniform::new(-1.0, 1.0).map_err(|_| bad("range_fraction", "above 0 and at most 1"))?;
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let middle = |limit: &JointLimits| 0.5 * (limit.position_min_rad + limit.position_max_rad);
        let mut current: Vec<f64> = limits.iter().map(middle).collect();
        let start_rad = current.clone();
        let mut moves = Vec::new();
        for number in 1..=self.moves {
            for ((q, limit), reach) in current.iter_mut().zip(limits).zip(&self.reach_rad) {
                let half =
                    0.5 * self.range_fraction * (limit.position_max_rad - limit.position_min_rad);
                let step = reach * unit.sample(&mut random);
                let target = *q + step;
                // A move that would leave the range goes in the other direction.
                let inside = (target - middle(limit)).abs() <= half;
                let target = if inside { target } else { *q - step };
                *q = target.clamp(middle(limit) - half, middle(limit) + half);
            }
            if number == self.moves {
                current.clone_from(&start_rad);
            }
            let mut part = |largest: f64| largest * (0.75 + 0.25 * unit.sample(&mut random));
            moves.push(Move {
                target_rad: current.clone(),
                velocity_fraction: part(self.velocity_fraction),
                acceleration_fraction: part(self.acceleration_fraction),
                dwell_s: self.dwell_s,
            });
        }
        Ok(MoveSequence { start_rad, start_dwell_s: self.dwell_s, moves })
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the stream is pinned bit by bit")]
mod tests {
    use super::*;
    use crate::trajectory::Trajectory;

    fn limits() -> Vec<JointLimits> {
        vec![
            JointLimits {
                position_min_rad: -1.0,
                position_max_rad: 2.0,
                velocity_max_rad_s: 3.0,
                acceleration_max_rad_s2: 20.0,
            };
            3
        ]
    }

    fn generator(seed: u64) -> RandomMoves {
        RandomMoves {
            seed,
            moves: 13,
            range_fraction: 0.9,
            reach_rad: vec![1.0, 2.0, 5.0],
            velocity_fraction: 1.0,
            acceleration_fraction: 0.8,
            dwell_s: 0.03,
        }
    }

    #[test]
    fn every_sequence_can_be_planned() {
        for seed in 0..200 {
            let sequence = generator(seed).draw_sequence(&limits()).unwrap();
            assert_eq!(sequence.moves.len(), 13);
            assert_eq!(sequence.moves[12].target_rad, sequence.start_rad);
            Trajectory::plan(&sequence, &limits()).unwrap();
        }
    }

    #[test]
    fn the_seed_decides() {
        let draw = |seed| generator(seed).draw_sequence(&limits()).unwrap();
        assert_eq!(draw(7), draw(7));
        assert_ne!(draw(7), draw(8));
    }

    /// Pins the stream: a new version of a dependency must not change shipped scenarios unseen.
    #[test]
    fn the_stream_is_the_one_it_always_was() {
        let first = &generator(1).draw_sequence(&limits()).unwrap().moves[0];
        assert_eq!(first.target_rad, [0.304_971_327_329_695_9, 1.85, 1.465_601_809_348_548_6]);
    }
}
