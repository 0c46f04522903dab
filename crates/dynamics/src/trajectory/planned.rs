//! A sequence of moves, planned.

use super::trapezoid::Trapezoid;
use super::{JointLimits, MoveSequence, Reference, TrajectoryError};
use crate::MAX_JOINTS;
use crate::robot::JointIndex;

/// A motion within limits: every joint's position, velocity and acceleration at every time.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    joints: usize,
    segments: Vec<Segment>,
    duration_s: f64,
}

/// One move with the dwell that follows; the dwell at the start is a move of no distance.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    start_s: f64,
    profile: Trapezoid,
    start_position: [f64; MAX_JOINTS],
    distance: [f64; MAX_JOINTS],
    end_position: [f64; MAX_JOINTS],
}

impl Trajectory {
    /// Plans `sequence` for an arm with the given limits, one entry per joint.
    ///
    /// The duration of a move is that of its slowest joint within its share of the limits. All
    /// joints follow the same path parameter, so velocities are proportional to distances.
    ///
    /// # Errors
    /// [`TrajectoryError`] names the move and the joint.
    pub fn plan(sequence: &MoveSequence, limits: &[JointLimits]) -> Result<Self, TrajectoryError> {
        let joints = limits.len();
        if joints == 0 || joints > MAX_JOINTS {
            return Err(TrajectoryError::ArmSize { count: joints, max: MAX_JOINTS });
        }
        limits.iter().enumerate().try_for_each(|(j, limit)| limit.validate(JointIndex::new(j)))?;
        let mut start_rad = check_posture(0, &sequence.start_rad, limits)?;
        let mut start_s = check_dwell(0, sequence.start_dwell_s)?;
        let mut segments = vec![Segment {
            start_s: 0.0,
            profile: Trapezoid::new(1.0, 1.0),
            start_position: start_rad,
            distance: [0.0; MAX_JOINTS],
            end_position: start_rad,
        }];
        for (index, m) in sequence.moves.iter().enumerate() {
            let number = index + 1;
            let end_rad = check_posture(number, &m.target_rad, limits)?;
            let velocity_fraction =
                check_fraction(number, "velocity_fraction", m.velocity_fraction)?;
            let acceleration_fraction =
                check_fraction(number, "acceleration_fraction", m.acceleration_fraction)?;
            let mut distance = [0.0; MAX_JOINTS];
            let (mut velocity, mut acceleration) = (f64::INFINITY, f64::INFINITY);
            for (((distance_of_joint, to), from), limit) in
                distance.iter_mut().zip(end_rad).zip(start_rad).zip(limits)
            {
                *distance_of_joint = to - from;
                if *distance_of_joint != 0.0 {
                    let length = distance_of_joint.abs();
                    velocity = velocity.min(velocity_fraction * limit.velocity_max_rad_s / length);
                    acceleration = acceleration
                        .min(acceleration_fraction * limit.acceleration_max_rad_s2 / length);
                }
            }
            if !velocity.is_finite() {
                return Err(TrajectoryError::NoMotion { number });
            }
            let profile = Trapezoid::new(velocity, acceleration);
            segments.push(Segment {
                start_s,
                profile,
                start_position: start_rad,
                distance,
                end_position: end_rad,
            });
            start_s += profile.duration_s() + check_dwell(number, m.dwell_s)?;
            start_rad = end_rad;
        }
        Ok(Self { joints, segments, duration_s: start_s })
    }

    /// Returns the time from the start to the end of the last dwell \[s\].
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns the start time of each move \[s\].
    pub fn move_starts_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.segments.iter().skip(1).map(|segment| segment.start_s)
    }
}

impl Reference for Trajectory {
    fn joints(&self) -> usize {
        self.joints
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        let begun = self.segments.partition_point(|segment| segment.start_s <= time_s);
        // The first segment begins at 0: before it, its start posture holds.
        let Some(segment) = self.segments.get(begun.saturating_sub(1)) else { return };
        let (s, ds, dds) = segment.profile.evaluate(time_s - segment.start_s);
        let out = position.iter_mut().zip(velocity).zip(acceleration);
        let distance_of_joint = segment
            .start_position
            .iter()
            .zip(&segment.distance)
            .zip(&segment.end_position)
            .take(self.joints);
        for (((q, dq), ddq), ((from, distance), to)) in out.zip(distance_of_joint) {
            // The arm rests exactly on the target, so that a motion can end where it starts.
            *q = if s < 1.0 { from + s * distance } else { *to };
            *dq = ds * distance;
            *ddq = dds * distance;
        }
    }
}

fn check_posture(
    number: usize,
    position: &[f64],
    limits: &[JointLimits],
) -> Result<[f64; MAX_JOINTS], TrajectoryError> {
    if position.len() != limits.len() {
        let (expected, found) = (limits.len(), position.len());
        return Err(TrajectoryError::JointCount { number, expected, found });
    }
    let mut posture = [0.0; MAX_JOINTS];
    for (j, ((q, limit), out)) in position.iter().zip(limits).zip(&mut posture).enumerate() {
        if !limit.contains(*q) {
            return Err(TrajectoryError::PositionLimit {
                number,
                joint: JointIndex::new(j),
                position_rad: *q,
                min_rad: limit.position_min_rad,
                max_rad: limit.position_max_rad,
            });
        }
        *out = *q;
    }
    Ok(posture)
}

fn check_fraction(number: usize, key: &'static str, value: f64) -> Result<f64, TrajectoryError> {
    if value > 0.0 && value <= 1.0 {
        Ok(value)
    } else {
        Err(TrajectoryError::Fraction { number, key, value })
    }
}

fn check_dwell(number: usize, value: f64) -> Result<f64, TrajectoryError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(TrajectoryError::Dwell { number, value })
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "positions at rest are exact")]
mod tests {
    use super::*;
    use crate::trajectory::Move;

    fn limits() -> Vec<JointLimits> {
        let limit = |range: f64, velocity, acceleration| JointLimits {
            position_min_rad: -range,
            position_max_rad: range,
            velocity_max_rad_s: velocity,
            acceleration_max_rad_s2: acceleration,
        };
        vec![limit(2.0, 3.0, 20.0), limit(3.0, 6.0, 30.0)]
    }

    fn sequence() -> MoveSequence {
        let move_to = |q: [f64; 2], dwell_s| Move {
            target_rad: q.to_vec(),
            velocity_fraction: 1.0,
            acceleration_fraction: 0.5,
            dwell_s,
        };
        MoveSequence {
            start_rad: vec![0.5, -1.0],
            start_dwell_s: 0.1,
            moves: vec![
                move_to([1.5, 1.0], 0.2),
                move_to([1.5, 0.9], 0.0),
                move_to([-2.0, 3.0], 0.3),
            ],
        }
    }

    fn states_at(trajectory: &Trajectory, time_s: f64) -> [[f64; 2]; 3] {
        let [mut q, mut dq, mut ddq] = [[f64::NAN; 2]; 3];
        trajectory.evaluate(time_s, &mut q, &mut dq, &mut ddq);
        [q, dq, ddq]
    }

    #[test]
    fn visits_its_targets_within_the_limits_and_without_jumps() {
        let trajectory = Trajectory::plan(&sequence(), &limits()).unwrap();
        assert_eq!(states_at(&trajectory, -1.0)[0], [0.5, -1.0]);
        assert_eq!(states_at(&trajectory, 0.1)[0], [0.5, -1.0]);
        let starts: Vec<f64> = trajectory.move_starts_s().collect();
        assert_eq!(states_at(&trajectory, starts[1] - 0.1), [[1.5, 1.0], [0.0; 2], [0.0; 2]]);
        assert_eq!(states_at(&trajectory, starts[2] - 1e-9)[0], [1.5, 0.9]);
        assert_eq!(states_at(&trajectory, trajectory.duration_s() + 5.0)[0], [-2.0, 3.0]);

        let step = 1e-4;
        let mut last = states_at(&trajectory, 0.0);
        for k in 1..=20_000 {
            let now = states_at(&trajectory, f64::from(k) * step);
            for j in 0..2 {
                let limit = limits()[j];
                assert!(limit.contains(now[0][j]));
                assert!(now[1][j].abs() <= limit.velocity_max_rad_s * (1.0 + 1e-12));
                assert!(now[2][j].abs() <= 0.5 * limit.acceleration_max_rad_s2 * (1.0 + 1e-12));
                let mean = 0.5 * (now[1][j] + last[1][j]);
                assert!((now[0][j] - last[0][j] - step * mean).abs() < 20.0 * step * step);
            }
            last = now;
        }
    }

    #[test]
    fn all_joints_start_and_arrive_together() {
        let trajectory = Trajectory::plan(&sequence(), &limits()).unwrap();
        let start = trajectory.move_starts_s().nth(2).unwrap();
        let end = trajectory.duration_s() - 0.3;
        for k in 1..100 {
            let [_, dq, _] = states_at(&trajectory, start + (end - start) * f64::from(k) / 100.0);
            assert!(dq[0] < 0.0 && dq[1] > 0.0, "{k}: {dq:?}");
            assert!((dq[0] / -3.5 - dq[1] / 2.1).abs() < 1e-12);
        }
    }

    #[test]
    fn errors_name_the_move_and_the_joint() {
        let plan = |change: fn(&mut MoveSequence)| {
            let mut sequence = sequence();
            change(&mut sequence);
            Trajectory::plan(&sequence, &limits()).unwrap_err()
        };
        let error = plan(|s| s.moves[2].target_rad[0] = 2.1);
        assert!(matches!(
            error,
            TrajectoryError::PositionLimit { number: 3, joint, .. } if joint.position() == 0));
        assert!(error.to_string().starts_with("move 3, joint 1: position 2.1 rad"), "{error}");
        let error = plan(|s| s.moves[1].target_rad = s.moves[0].target_rad.clone());
        assert_eq!(error, TrajectoryError::NoMotion { number: 2 });
        let error = plan(|s| s.start_rad.push(0.0));
        assert!(matches!(error, TrajectoryError::JointCount { number: 0, .. }));
        let error = plan(|s| s.moves[0].velocity_fraction = 1.5);
        assert!(matches!(error, TrajectoryError::Fraction { number: 1, .. }));
        let error = plan(|s| s.moves[0].target_rad[1] = f64::NAN);
        assert!(matches!(
            error,
            TrajectoryError::PositionLimit { number: 1, joint, .. } if joint.position() == 1));
        let error = plan(|s| s.moves[2].dwell_s = -1.0);
        assert!(matches!(error, TrajectoryError::Dwell { number: 3, .. }));
    }
}
