//! Low-passed signals of one motor: the model fits far better behind, or before, a low-pass.
//!
//! A small lag is a separate nuisance parameter, and its column is the rate of the torque. A large
//! lag is not. Where friction reverses, the torque is a step and its rate a spike. The spike
//! absorbs some ten milliseconds of a lag, however large the lag is. The fit takes viscous friction
//! that lags by the rest for inertia.
//!
//! So two versions of the motor's torque are tried. One is the torque before a first-order
//! low-pass. The other is the torque behind one, which matches a low-passed position. The rows are
//! those behind the decimation filter, which does not affect a low-pass.

use didim_dynamics::robot::MotorIndex;
use nalgebra::DVector;

use super::checks::FittedModel;
use super::reasons::{Note, Slow};
use super::refit::{INSPECTED, Refit};
use didim_dynamics::MAX_JOINTS;

/// Largest time constant tried \[s\].
const SLOWEST_S: f64 = 0.25;

/// Ratio of successive time constants. The first is the time between rows.
const STEP: f64 = core::f64::consts::SQRT_2;

/// Share of the residual of the motor's joints, in weighted squares, that a low-pass has to
/// explain.
const EXPLAINS: f64 = 0.3;

/// Low-pass that explains much of the model residual.
pub(super) struct LowPassed {
    pub(super) note: Note,
    /// Explained share of the residual of its joints.
    explains: f64,
    /// Parameter shift without the low-pass.
    pub(super) shifted: DVector<f64>,
}

impl FittedModel<'_> {
    /// Returns the best-fitting low-pass of all signals together and of each motor, for joints with
    /// a large residual torque. `residuals` are those of the parameters, `levels` their root mean
    /// squares.
    pub(super) fn low_passed(&self, residuals: &DVector<f64>, levels: &[f64]) -> Vec<LowPassed> {
        let (observations, rows) = (self.observations, self.observations.rows_per_joint());
        let transmission = self.context.robot.transmission();
        let unexplained = self.unexplained(levels);
        // Most of the residual of unfiltered rows is noise.
        if !unexplained.contains(&true) || self.context.decimation.is_none() {
            return Vec::new();
        }
        // Sum over the joints of squared residuals, each relative to the joint's level.
        let squares = |left: &DVector<f64>| -> f64 {
            let left = observations.rms_per_joint(left);
            (left.iter().zip(levels).enumerate())
                .filter(|(joint, _)| self.context.has_torque(*joint))
                .map(|(_, (left, own))| (left / own).powi(2))
                .sum()
        };
        let recorded = observations.matrix().joints_with_equation();
        let (joints, silent) = (levels.len(), self.analysis.rows_without_equation());
        let tried = |motor: usize| {
            let acts_on = |joint: &usize| {
                transmission.row(motor)[*joint] != 0.0 && self.context.has_torque(*joint)
            };
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
                    let left = residuals + of_all - observations.matrix().times_parameters(&moved);
                    let explains = (recorded as f64 - squares(&left)) / own;
                    if explains > best.as_ref().map_or(EXPLAINS, |best| best.explains) {
                        let note = Note::LowPassed {
                            motor: MotorIndex::new(motor),
                            slow,
                            time_constant_s,
                        };
                        best = Some(LowPassed { note, explains, shifted: moved });
                    }
                }
            }
            best
        };
        let is_asked = |motor: &usize| {
            (0..joints).any(|joint| unexplained[joint] && transmission.row(*motor)[joint] != 0.0)
        };
        let mut recorded_joints = (0..joints).filter(|joint| self.context.has_torque(*joint));
        let together = recorded_joints
            .all(|joint| unexplained[joint])
            .then(|| self.all_low_passed())
            .flatten();
        together.into_iter().chain((0..joints).filter(is_asked).filter_map(tried)).collect()
    }

    /// Returns the time constants tried \[s\].
    fn time_constants_s(&self) -> impl Iterator<Item = f64> + use<> {
        let shortest_s = 1.0 / self.context.rows_hz();
        let longer = |before: &f64| Some(before * STEP);
        core::iter::successors(Some(shortest_s), longer).take_while(|of| *of <= SLOWEST_S)
    }

    /// Returns the best-fitting low-pass of all signals together. Inertias are then those of the
    /// arm, because both sides have passed the same filter. Friction at reversals and gravity are
    /// not.
    fn all_low_passed(&self) -> Option<LowPassed> {
        let logged = self.context.experiment.first_samples(INSPECTED);
        let Refit { parameters, remaining: left } = Refit::new(self.context, &logged).ok()?;
        let tried = |time_constant_s: f64| {
            // A filter without a solution does not fit better.
            let before = logged.before_low_pass(time_constant_s);
            let before = Refit::new(self.context, &before).ok()?;
            let (explains, moved) =
                (1.0 - before.remaining / left, before.parameters - &parameters);
            let note = Note::AllLowPassed { time_constant_s };
            (explains > EXPLAINS).then_some(LowPassed { note, explains, shifted: moved })
        };
        let tried = self.time_constants_s().filter_map(tried);
        tried.max_by(|one, other| one.explains.total_cmp(&other.explains))
    }

    /// Returns the rows of a motor's torque \[N·m\].
    fn torque_of(&self, motor: usize) -> DVector<f64> {
        let measured = self.observations.measured_values();
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

    /// Returns the torque change that such a low-pass adds (position behind a low-pass) or removed
    /// (torque behind one).
    fn change(&self, torque: &DVector<f64>, slow: Slow, time_constant_s: f64) -> DVector<f64> {
        let (samples, factor) = (&self.context.samples, self.context.decimation.factor());
        let share = 1.0 - (-1.0 / (self.context.rows_hz() * time_constant_s)).exp();
        let mut behind = 0.0;
        DVector::from_fn(torque.len(), |row, _| {
            let before =
                row.checked_sub(1).filter(|before| samples[row] - samples[*before] == factor);
            // At the start of a recording and behind a gap, the earlier torque is assumed to be the
            // same.
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
