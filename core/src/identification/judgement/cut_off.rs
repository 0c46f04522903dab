//! Torques that say nothing for a part of the time: a signal that never changes, or stands at its largest value again and again.

use core::ops::Range;

use crate::MAX_JOINTS;
use crate::identification::given::Context;

/// The share of all samples that has to be at the largest value.
const SHARE: f64 = 0.05;

/// Values beyond this share of the largest are beside it: a signal that is not cut off has more of them.
const BESIDE: f64 = 0.8;

/// Values beyond this share of the largest are it, whatever the transmission rounds.
const SAME: f64 = 1.0 - 1e-9;

/// Different values of a signal, with fewer of which the largest recurs by itself.
const VALUES: usize = 20;

/// The torque of a motor that stands at a value again and again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutOff {
    /// The motor, numbered from 1.
    pub motor: usize,
    /// The value \[N·m or N\].
    pub torque: f64,
    /// The share of the samples of a recording where it is that; 1 where it is never another.
    pub share: f64,
}

impl CutOff {
    /// Each motor whose torque is.
    pub(super) fn all(context: &Context<'_>) -> Vec<Self> {
        (0..context.robot.joints()).filter_map(|motor| Self::of(context, motor)).collect()
    }

    /// In the first recording where it is.
    fn of(context: &Context<'_>, motor: usize) -> Option<Self> {
        let mut recordings = context.experiment.recordings().iter();
        recordings.find_map(|of| {
            let (torque, share) = standing(&torque_of(context, motor, of.counted.clone()))?;
            Some(Self { motor: motor + 1, torque, share })
        })
    }

    /// Whether it is never another.
    pub(super) fn is_constant(&self) -> bool {
        self.share >= 1.0
    }
}

/// The torque of a motor in some samples \[N·m or N\].
fn torque_of(context: &Context<'_>, motor: usize, samples: Range<usize>) -> Vec<f64> {
    let (torques, joints) = (context.experiment.torque_nm(), context.robot.joints());
    let torque = |sample: usize| {
        let [mut of_joints, mut of_motors] = [[0.0; MAX_JOINTS]; 2];
        for (joint, torque) in of_joints.iter_mut().zip(torques.row(sample).iter()) {
            *joint = *torque;
        }
        let transmission = context.robot.transmission();
        transmission.motor_torque(&of_joints[..joints], &mut of_motors[..joints]);
        of_motors[motor]
    };
    samples.map(torque).collect()
}

/// The value at which a signal stands, and in which share of it.
fn standing(signal: &[f64]) -> Option<(f64, f64)> {
    let first = signal.first().copied()?;
    if signal.iter().all(|other| (other - first).abs() <= (1.0 - SAME) * first.abs()) {
        return Some((first, 1.0));
    }
    [1.0, -1.0].into_iter().find_map(|sign| {
        let largest = signal.iter().map(|value| sign * value).fold(0.0, f64::max);
        let beyond =
            |share: f64| signal.iter().filter(|value| sign * **value >= share * largest).count();
        let (at, beside) = (beyond(SAME), beyond(BESIDE));
        let share = at as f64 / signal.len() as f64;
        let is_cut = largest > 0.0 && share > SHARE && 2 * at > beside;
        (is_cut && values(signal) >= VALUES).then_some((sign * largest, share))
    })
}

/// How many different values a signal has, as far as they count.
fn values(signal: &[f64]) -> usize {
    let mut sorted = signal.to_vec();
    sorted.sort_by(f64::total_cmp);
    let is_next =
        |pair: &&[f64]| pair[1] - pair[0] > (1.0 - SAME) * pair[0].abs().max(pair[1].abs());
    1 + sorted.windows(2).filter(is_next).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_is_cut_off_is_told_from_a_coarse_one() {
        let sine = |change: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..2000).map(|k| change((0.01 * f64::from(k)).sin() + 0.2)).collect()
        };
        assert_eq!(standing(&sine(&|value| value)), None);
        // Steps of a tenth of the range: eleven values, of which the largest comes often.
        assert_eq!(standing(&sine(&|value| (5.0 * value).round())), None);
        let (largest, share) = standing(&sine(&|value| value.min(0.9))).unwrap();
        assert!(largest >= 0.9 && (0.2..0.3).contains(&share), "{largest} {share}");
        let (largest, share) = standing(&sine(&|value| value.max(-0.4))).unwrap();
        assert!(largest <= -0.4 && (0.25..0.35).contains(&share), "{largest} {share}");
        assert_eq!(standing(&[1.5; 100]), Some((1.5, 1.0)));
        assert_eq!(standing(&[]), None);
    }
}
