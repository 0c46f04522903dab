//! Frozen positions in a log: a signal stands still while the motor moves, and then jumps.

use core::cmp::Ordering;
use core::ops::Range;
use didim_dynamics::robot::MotorIndex;

use crate::identification::problem::Context;
use didim_dynamics::MAX_JOINTS;

/// Smallest number of samples over which a frozen signal stands still.
const ZERO_ORDER_HOLD: usize = 4;

/// Smallest jump, relative to the motor's largest step in one sample.
const BEYOND: f64 = 2.0;

/// Smallest range of a motor that is checked \[rad or m\].
const MOVES: f64 = 0.01;

/// Values that differ by at most this share of the range are the same, despite rounding by the
/// transmission.
const SAME: f64 = 1e-9;

/// Share of frozen samples in a recording above which the fault is serious.
const MUCH: f64 = 0.001;

/// Positions of motors that freeze and then jump together.
#[derive(Clone, Debug, PartialEq)]
pub struct FrozenSignal {
    /// The motors.
    pub motors: Vec<MotorIndex>,
    /// The recording, numbered from 1.
    pub recording: usize,
    /// Start of the frozen section before the largest jump, since the recording's first sample
    /// \[s\].
    pub from_s: f64,
    /// Time of the jump \[s\].
    pub until_s: f64,
    /// Jump relative to the motor's largest step in one sample: the largest of these motors.
    pub jump: f64,
    /// Share of the recording's samples that are frozen before such jumps: the largest of these
    /// motors.
    pub share: f64,
}

impl FrozenSignal {
    /// Returns the recording with the largest jump for each affected motor. Recordings with a
    /// serious fault take precedence. Motors that are frozen over the same time are merged.
    pub(super) fn all(context: &Context<'_>) -> Vec<Self> {
        let rate_hz = context.experiment.sample_rate_hz();
        let of_motor = |motor: usize| {
            let recordings = (1..).zip(context.experiment.recordings());
            let found = recordings.filter_map(|(recording, of)| {
                let positions: Vec<f64> =
                    of.counted_samples.clone().map(|k| position_at(context, k, motor)).collect();
                let Still { samples, jump, held: fixed } = held(&positions)?;
                let at_s =
                    |k: usize| (of.counted_samples.start - of.samples.start + k) as f64 / rate_hz;
                let (from_s, until_s) = (at_s(samples.start), at_s(samples.end));
                let share = fixed as f64 / positions.len() as f64;
                Some(Self {
                    motors: vec![MotorIndex::new(motor)],
                    recording,
                    from_s,
                    until_s,
                    jump,
                    share,
                })
            });
            let key = |of: &Self| (of.is_much(), of.jump);
            found.max_by(|one, other| key(one).partial_cmp(&key(other)).unwrap_or(Ordering::Equal))
        };
        let mut all: Vec<Self> = Vec::new();
        for found in (0..context.robot.joints()).filter_map(of_motor) {
            let at = |of: &Self| (of.recording, of.from_s.to_bits(), of.until_s.to_bits());
            match all.iter_mut().find(|own| at(own) == at(&found)) {
                Some(own) => {
                    own.motors.extend(found.motors);
                    own.jump = own.jump.max(found.jump);
                    own.share = own.share.max(found.share);
                }
                None => all.push(found),
            }
        }
        all
    }

    /// True if the fault is serious.
    pub(super) fn is_much(&self) -> bool {
        self.share > MUCH
    }
}

/// Returns the position of a motor at a sample \[rad or m\].
fn position_at(context: &Context<'_>, sample: usize, motor: usize) -> f64 {
    let (positions, joints) = (context.experiment.position_rad(), context.robot.joints());
    let [mut of_joints, mut of_motors] = [[0.0; MAX_JOINTS]; 2];
    for (joint, position) in of_joints.iter_mut().zip(positions.row(sample).iter()) {
        *joint = *position;
    }
    let transmission = context.robot.transmission();
    transmission.motor_position(&of_joints[..joints], &mut of_motors[..joints]);
    of_motors[motor]
}

/// Frozen signal.
struct Still {
    /// Samples from the first frozen one to the one after the largest jump.
    samples: Range<usize>,
    /// Largest jump, relative to the largest step in one sample.
    jump: f64,
    /// Number of frozen samples before all such jumps.
    held: usize,
}

fn held(signal: &[f64]) -> Option<Still> {
    let steps: Vec<f64> = signal.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let [low, high] = signal
        .iter()
        .fold([f64::MAX, f64::MIN], |[low, high], value| [low.min(*value), high.max(*value)]);
    let same = SAME * (high - low);
    // Only steps that follow another step count, because a resting signal starts slowly.
    let following = steps.windows(2).filter(|pair| pair[0] > same);
    let fastest = following.map(|pair| pair[1]).fold(0.0, f64::max);
    if high - low < MOVES || fastest <= same {
        return None;
    }
    let (mut still, mut held, mut largest) = (0, 0, None);
    for (k, step) in steps.iter().enumerate() {
        if *step <= same {
            still += 1;
            continue;
        }
        let jump = step / fastest;
        if still >= ZERO_ORDER_HOLD && jump > BEYOND {
            held += still;
            if largest.as_ref().is_none_or(|(_, before)| jump > *before) {
                largest = Some((k - still..k + 1, jump));
            }
        }
        still = 0;
    }
    largest.map(|(samples, jump)| Still { samples, jump, held })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_is_held_is_told_from_one_that_rests_or_is_coarse() {
        let sine = |change: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
            (0..2000).map(|k| change(k, (0.01 * k as f64).sin())).collect()
        };
        let original = sine(&|_, value| value);
        assert!(held(&original).is_none());
        // An encoder of few counts, an arm that rests between its moves.
        assert!(held(&sine(&|_, value| (value * 20.0).round() / 20.0)).is_none());
        assert!(held(&sine(&|_, value| value.max(0.0))).is_none());
        assert!(held(&sine(&|_, _| 0.3)).is_none());
        assert!(held(&[]).is_none());
        // The signal is frozen where it is fastest, at 0, for 20 samples.
        let found =
            held(&sine(&|k, value| if (629..649).contains(&k) { original[628] } else { value }));
        let found = found.unwrap();
        assert_eq!(found.samples, 628..649);
        assert_eq!(found.held, 20);
        assert!((found.jump - 21.0).abs() < 0.3, "{}", found.jump);
    }
}
