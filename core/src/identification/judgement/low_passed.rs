//! Signals of one motor that the model fits far better behind, or before, a low-pass.
//!
//! A small lag is a freedom of its own, whose column is the rate of the torque. A large one is none: where friction reverses,
//! the torque is a step and its rate a spike, which takes some ten milliseconds of a lag, however large that is. Viscous
//! friction that lags by the rest is taken for inertia. So the motor's torque is tried as what it was before a low-pass of
//! first order, and behind one, as a position that is low-passed wants it. The rows are those behind the decimation filter, which a
//! low-pass does not mind.

use nalgebra::DVector;

use super::checks::FittedModel;
use super::reasons::{Note, Slow};
use super::refitted::{LOOKED_AT, Refitted};
use crate::MAX_JOINTS;

/// The largest time constant that is tried \[s\].
const SLOWEST_S: f64 = 0.25;

/// Each is so many times the one before, from the time between rows on.
const STEP: f64 = core::f64::consts::SQRT_2;

/// The share of what the motor's joints leave, in weighted squares, that a low-pass has to explain.
const EXPLAINS: f64 = 0.3;

/// A low-pass that explains much of what the model leaves.
pub(super) struct LowPassed {
    pub(super) note: Note,
    /// The share of what its joints leave that it explains.
    explains: f64,
    /// How far the parameters move without it.
    pub(super) moved: DVector<f64>,
}

impl FittedModel<'_> {
    /// What fits best of all signals together, and of each motor's, where joints leave much of their torque; `residuals` are what the parameters leave, `levels`
    /// their root mean squares.
    pub(super) fn low_passed(&self, residuals: &DVector<f64>, levels: &[f64]) -> Vec<LowPassed> {
        let (observations, rows) = (self.observations, self.observations.rows_per_joint());
        let transmission = self.context.robot.transmission();
        let unexplained = self.unexplained(levels);
        // Of rows that no filter has passed, noise is most of what is left.
        if !unexplained.contains(&true) || self.context.decimation.is_none() {
            return Vec::new();
        }
        // Of what each joint leaves, so many times its own.
        let squares = |left: &DVector<f64>| -> f64 {
            let left = observations.rms_per_joint(left);
            left.iter().zip(levels).map(|(left, own)| (left / own).powi(2)).sum()
        };
        let (joints, silent) = (levels.len(), self.analysis.rows_without_equation());
        let tried = |motor: usize| {
            let acts_on = |joint: &usize| transmission.row(motor)[*joint] != 0.0;
            let own = (0..joints).filter(acts_on).count() as f64;
            let torque = self.torque_of(motor);
            let mut best: Option<LowPassed> = None;
            for time_constant_s in self.time_constants_s() {
                for slow in [Slow::Torque, Slow::Position] {
                    let change = self.change(&torque, slow, time_constant_s);
                    let mut of_all = DVector::zeros(joints * rows);
                    for joint in (0..joints).filter(acts_on) {
                        let ratio = transmission.row(motor)[joint];
                        of_all.rows_mut(joint * rows, rows).copy_from(&(&change * ratio));
                    }
                    silent.iter().for_each(|row| of_all[*row] = 0.0);
                    let moved = self.analysis.estimate_shift(&of_all);
                    let left = residuals + of_all - observations.matrix().times(&moved);
                    let explains = (joints as f64 - squares(&left)) / own;
                    if explains > best.as_ref().map_or(EXPLAINS, |best| best.explains) {
                        let note = Note::LowPassed { motor: motor + 1, slow, time_constant_s };
                        best = Some(LowPassed { note, explains, moved });
                    }
                }
            }
            best
        };
        let is_asked = |motor: &usize| {
            (0..joints).any(|joint| unexplained[joint] && transmission.row(*motor)[joint] != 0.0)
        };
        let together = unexplained.iter().all(|of| *of).then(|| self.all_low_passed()).flatten();
        together.into_iter().chain((0..joints).filter(is_asked).filter_map(tried)).collect()
    }

    /// Those that are tried \[s\].
    fn time_constants_s(&self) -> impl Iterator<Item = f64> + use<> {
        let shortest_s = 1.0 / self.context.rows_hz();
        let longer = |before: &f64| Some(before * STEP);
        core::iter::successors(Some(shortest_s), longer).take_while(|of| *of <= SLOWEST_S)
    }

    /// What fits best of all signals together. Inertias are those of the arm then, for both sides have passed the same; friction
    /// that reverses and gravity are not.
    fn all_low_passed(&self) -> Option<LowPassed> {
        let logged = self.context.experiment.beginning(LOOKED_AT);
        let Refitted { parameters, left } = Refitted::new(self.context, &logged).ok()?;
        let tried = |time_constant_s: f64| {
            // Where it has no solution, it does not fit better.
            let before = logged.before_low_pass(time_constant_s);
            let before = Refitted::new(self.context, &before).ok()?;
            let (explains, moved) = (1.0 - before.left / left, before.parameters - &parameters);
            let note = Note::AllLowPassed { time_constant_s };
            (explains > EXPLAINS).then_some(LowPassed { note, explains, moved })
        };
        let tried = self.time_constants_s().filter_map(tried);
        tried.max_by(|one, other| one.explains.total_cmp(&other.explains))
    }

    /// The rows of a motor's torque \[N·m\].
    fn torque_of(&self, motor: usize) -> DVector<f64> {
        let measured = self.observations.measured();
        let (rows, joints) = (self.observations.rows_per_joint(), self.observations.joints());
        let torque = |row: usize| {
            let [mut of_joints, mut of_motors] = [[0.0; MAX_JOINTS]; 2];
            for (joint, torque) in of_joints.iter_mut().enumerate().take(joints) {
                *torque = measured[joint * rows + row];
            }
            let transmission = self.context.robot.transmission();
            transmission.motor_torque(&of_joints[..joints], &mut of_motors[..joints]);
            of_motors[motor]
        };
        DVector::from_iterator(rows, (0..rows).map(torque))
    }

    /// What such a low-pass adds to a torque, where the position is behind one; or took from it.
    fn change(&self, torque: &DVector<f64>, slow: Slow, time_constant_s: f64) -> DVector<f64> {
        let (samples, factor) = (&self.context.samples, self.context.decimation.factor());
        let share = 1.0 - (-1.0 / (self.context.rows_hz() * time_constant_s)).exp();
        let mut behind = 0.0;
        DVector::from_fn(torque.len(), |row, _| {
            let before =
                row.checked_sub(1).filter(|before| samples[row] - samples[*before] == factor);
            // At the beginning of a recording, and behind a hole, the torque was the same before.
            let Some(before) = before else {
                behind = torque[row];
                return 0.0;
            };
            match slow {
                Slow::Torque => (torque[row] - torque[before]) * (1.0 / share - 1.0),
                Slow::Position => {
                    behind += share * (torque[row] - behind);
                    behind - torque[row]
                }
            }
        })
    }
}
