//! Torques that are cut off: a signal stands at its largest value again and again, and the model does not explain it.

use super::reasons::Reason;
use super::verdict::UNEXPLAINED;
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

/// The first motor whose torque is cut off, of those that drive a joint that leaves much of its torque; `errors` are the relative
/// errors of all joints.
pub(super) fn cut_off(context: &Context<'_>, errors: &[f64]) -> Option<Reason> {
    let transmission = context.robot.transmission();
    let is_asked = |motor: &usize| {
        let joints = errors.iter().zip(transmission.row(*motor));
        joints.into_iter().any(|(error, ratio)| *error > UNEXPLAINED && *ratio != 0.0)
    };
    let torques = context.experiment.torque_nm();
    let of_motor = |motor: usize| -> Vec<f64> {
        let torque = |sample: usize| {
            let [mut of_joints, mut of_motors] = [[0.0; MAX_JOINTS]; 2];
            for (joint, torque) in of_joints.iter_mut().zip(torques.row(sample).iter()) {
                *joint = *torque;
            }
            transmission.motor_torque(&of_joints[..errors.len()], &mut of_motors[..errors.len()]);
            of_motors[motor]
        };
        context.experiment.counted_samples().map(torque).collect()
    };
    let found = |motor: usize| {
        let torque = of_motor(motor);
        [1.0, -1.0].into_iter().find_map(|sign| {
            let largest = torque.iter().map(|torque| sign * torque).fold(0.0, f64::max);
            let beyond = |share: f64| {
                torque.iter().filter(|torque| sign * **torque >= share * largest).count()
            };
            let (at, beside) = (beyond(SAME), beyond(BESIDE));
            let share = at as f64 / torque.len() as f64;
            let is_cut = largest > 0.0 && share > SHARE && 2 * at > beside;
            (is_cut && values(&torque) >= VALUES).then_some(Reason::CutOff {
                motor: motor + 1,
                torque: sign * largest,
                share,
            })
        })
    };
    (0..errors.len()).filter(is_asked).find_map(found)
}

/// How many different values a signal has, as far as they count.
fn values(signal: &[f64]) -> usize {
    let mut sorted = signal.to_vec();
    sorted.sort_by(f64::total_cmp);
    let is_next = |pair: &&[f64]| pair[1] - pair[0] > (1.0 - SAME) * pair[1].abs();
    1 + sorted.windows(2).filter(is_next).count()
}
