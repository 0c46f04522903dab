//! Torques without a sign: a signal of absolute values turns back wherever it should cross zero.

use super::clipped_signal::torques_at;
use crate::identification::problem::Context;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::MotorIndex;

/// Places at which a torque is about to cross zero and turns back. A torque with a sign crosses as
/// often as not, so that 15 have odds of 33,000 to 1.
const TURNS: usize = 15;

/// Returns the motors whose torque never crosses zero, but turns back just before it again and
/// again. None if the torque of any motor crosses zero: a logger records all of them alike.
pub(super) fn unsigned_torques(context: &Context<'_>) -> Vec<MotorIndex> {
    let mut turns = [0; MAX_JOINTS];
    let mut signs = [0.0; MAX_JOINTS];
    let motors: Vec<usize> =
        (0..context.robot.joints()).filter(|motor| context.has_motor_torque(*motor)).collect();
    for recording in context.experiment.recordings() {
        let mut last = [[0.0; MAX_JOINTS]; 2];
        for sample in recording.counted_samples.clone() {
            let torques = torques_at(context, sample);
            for motor in &motors {
                let [before, now, next] = [last[0][*motor], last[1][*motor], torques[*motor]];
                if next * signs[*motor] < 0.0 {
                    return Vec::new();
                }
                if next != 0.0 {
                    signs[*motor] = next;
                }
                // It falls, would cross, and does not.
                let is_turn = now.abs() < before.abs() && (2.0 * now - before) * before < 0.0;
                turns[*motor] += usize::from(is_turn);
            }
            last = [last[1], torques];
        }
    }
    motors.into_iter().filter(|motor| turns[*motor] >= TURNS).map(MotorIndex::new).collect()
}
