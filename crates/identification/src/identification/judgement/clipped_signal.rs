//! Torques that say nothing for a part of the time: a signal that never changes, or stands at its
//! largest value again and again.

use crate::identification::problem::Context;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::MotorIndex;

/// Samples of a recording, with fewer of which it is not asked.
const SAMPLES: usize = 1000;

/// The share of these that has to be at the largest value.
const SHARE: f64 = 0.05;

/// Values beyond this share of the largest are beside it: a signal that is not cut off has more of
/// them.
const AUXILIARY: f64 = 0.8;

/// Different values of the same sign, with fewer of which the largest recurs by itself.
const VALUES: usize = 20;

/// Values that differ by this share of the largest torque of all motors are the same, whatever the
/// transmission rounds.
const SAME: f64 = 1e-9;

/// The torque of a motor that stands at a value again and again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClippedSignal {
    /// The motor.
    pub motor: MotorIndex,
    /// The value \[N·m or N\].
    pub torque: f64,
    /// The share of the samples of a recording where it is that, the largest of all; 1 where it
    /// never is another in any.
    pub share: f64,
}

impl ClippedSignal {
    /// Each motor whose torque is.
    pub(super) fn all(context: &Context<'_>) -> Vec<Self> {
        let joints = context.robot.joints();
        let mut ranges = vec![[f64::MAX, f64::MIN]; joints];
        for torques in context.experiment.counted_samples().map(|k| torques_at(context, k)) {
            for ([low, high], torque) in ranges.iter_mut().zip(torques) {
                (*low, *high) = (low.min(torque), high.max(torque));
            }
        }
        let largest = ranges.iter().flatten().fold(0.0, |most: f64, torque| most.max(torque.abs()));
        let same = SAME * largest;
        let of_motor = |motor: usize| {
            let [low, high] = ranges[motor];
            let (torque, share) = match high - low <= same {
                true => (high, 1.0),
                false => Self::standing_in_any(context, motor, same)?,
            };
            Some(Self { motor: MotorIndex::new(motor), torque, share })
        };
        let motors = (0..joints).filter(|motor| context.has_motor_torque(*motor));
        motors.filter_map(of_motor).collect()
    }

    /// Whether it is never another.
    pub(super) fn is_constant(&self) -> bool {
        self.share >= 1.0
    }

    /// The value at which a motor's torque stands in the largest share of a recording, and that
    /// share.
    fn standing_in_any(context: &Context<'_>, motor: usize, same: f64) -> Option<(f64, f64)> {
        let recordings = context.experiment.recordings().iter();
        let long = recordings.filter(|of| of.counted_samples.len() >= SAMPLES);
        let found = long.filter_map(|of| {
            let torque = of.counted_samples.clone().map(|k| torques_at(context, k)[motor]);
            standing(torque.collect(), same)
        });
        found.max_by(|one, other| one.1.total_cmp(&other.1))
    }
}

/// The torques of all motors at a sample \[N·m or N\].
pub(super) fn torques_at(context: &Context<'_>, sample: usize) -> [f64; MAX_JOINTS] {
    let (torques, joints) = (context.experiment.torque_nm(), context.robot.joints());
    let [mut of_joints, mut of_motors] = [[0.0; MAX_JOINTS]; 2];
    for (joint, torque) in of_joints.iter_mut().zip(torques.row(sample).iter()) {
        *joint = *torque;
    }
    let transmission = context.robot.transmission();
    transmission.motor_torque(&of_joints[..joints], &mut of_motors[..joints]);
    of_motors
}

/// The value at which a signal stands, and in which share of it.
fn standing(mut signal: Vec<f64>, same: f64) -> Option<(f64, f64)> {
    signal.sort_unstable_by(f64::total_cmp);
    let all = signal.len() as f64;
    // From the largest on, either way.
    let of_sign = |values: &mut dyn Iterator<Item = f64>, sign: f64| {
        let own: Vec<f64> = values.take_while(|value| *value > 0.0).collect();
        let largest = *own.first()?;
        let until = |least: f64| own.partition_point(|value| *value >= least);
        let (at, auxiliary) = (until(largest - same), until(AUXILIARY * largest));
        let different = 1 + own.windows(2).filter(|pair| pair[0] - pair[1] > same).count();
        let share = at as f64 / all;
        let is_cut = share > SHARE && 2 * at > auxiliary && different >= VALUES;
        is_cut.then_some((sign * largest, share))
    };
    let positive = of_sign(&mut signal.iter().rev().copied(), 1.0);
    positive.or_else(|| of_sign(&mut signal.iter().map(|value| -value), -1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_is_cut_off_is_told_from_a_coarse_one() {
        let of_sine = |change: &dyn Fn(f64) -> f64| {
            let sine = (0..2000).map(|k| change((0.01 * f64::from(k)).sin())).collect();
            standing(sine, 1e-9)
        };
        assert_eq!(of_sine(&|value| value), None);
        // Of coarse ones the largest comes often: of few values, of few on one side, and of just
        // more.
        for steps in [5.0, 10.49, 13.45, 14.49, 20.0, 40.0] {
            assert_eq!(of_sine(&|value| (steps * value).round()), None, "{steps}");
        }
        assert_eq!(of_sine(&|value| (30.0 * value - 28.0).round()), None);
        let (largest, share) = of_sine(&|value| value.min(0.7)).unwrap();
        assert!((largest - 0.7).abs() < 1e-12 && (0.2..0.3).contains(&share), "{largest} {share}");
        let (largest, share) = of_sine(&|value| value.max(-0.6)).unwrap();
        assert!((largest + 0.6).abs() < 1e-12 && (0.25..0.35).contains(&share), "{share}");
        assert_eq!(standing(Vec::new(), 1e-9), None);
    }
}
