//! The columns of what the model does not have, filtered and decimated as its own.

use nalgebra::{DMatrix, DVector};

use super::Subject;
use crate::MAX_JOINTS;
use crate::dispatch::vectorised;
use crate::dynamics::Workspace;
use crate::identification::error::IdentificationError;
use crate::identification::prefilter::{GROUP, Motion, MotionGroup, derivatives, group_of};
use crate::lanes::Lanes;
use crate::scalar::Scalar;

/// Speeds at which the tried friction laws bend, as shares of the highest speed of the window.
const BENDS: [f64; 3] = [0.003, 0.02, 0.1];

/// Columns for one subject.
pub(super) struct Columns<'a> {
    subject: &'a Subject<'a>,
    /// Torque of the estimate along the whole motion, samples × joints \[N·m\].
    torque: DMatrix<f64>,
}

impl<'a> Columns<'a> {
    pub(super) fn new(subject: &'a Subject<'a>) -> Self {
        Self { subject, torque: torque_along(subject, subject.motion) }
    }

    /// Friction of other shapes over the speed `u = directionᵀ q̇`, acting in this direction on the
    /// joints: tanh(u/w) less the model's own sign function, for bends w far apart. For each
    /// direction; none where nothing moves.
    ///
    /// Above the last bend all of them vanish: what the model calls Coulomb friction stays what it
    /// is there, and moves only as far as the shape below is another.
    pub(super) fn friction(
        &self,
        directions: &[Vec<f64>],
    ) -> Result<Vec<Option<DMatrix<f64>>>, IdentificationError> {
        let Subject { experiment, decimation, robot, .. } = *self.subject;
        let speeds: Vec<DVector<f64>> = directions.iter().map(|of| self.speed(of)).collect();
        let counted = experiment.counted();
        let highest = |speed: &DVector<f64>| speed.rows_range(counted.clone()).amax();
        let highest: Vec<f64> = speeds.iter().map(highest).collect();
        let moving: Vec<(&[f64], f64)> = (speeds.iter().zip(&highest))
            .filter(|(_, highest)| **highest > 0.0)
            .map(|(speed, highest)| (speed.as_slice(), *highest))
            .collect();
        let sign = robot.sign_model();
        let read = |first, laws: &mut [[f64; GROUP]]| {
            vectorised(
                #[inline(always)]
                || {
                    for (laws, &(speed, highest)) in laws.chunks_exact_mut(BENDS.len()).zip(&moving)
                    {
                        let u = group_of(speed, first);
                        let model = sign.value(u);
                        for (law, bend) in laws.iter_mut().zip(BENDS) {
                            *law = ((u / Lanes::constant(bend * highest)).tanh() - model).0;
                        }
                    }
                },
            );
        };
        let samples = self.subject.motion.velocity.nrows();
        let signals = moving.len() * BENDS.len();
        let laws = decimation
            .decimate_groups(samples, signals, experiment.counted(), read)
            .map_err(IdentificationError::RegressorFilter)?;
        let laws = experiment.fitted(decimation, laws);
        let rows = laws.nrows();
        let mut next = 0;
        let columns = directions.iter().zip(highest).map(|(direction, highest)| {
            if highest <= 0.0 {
                return None;
            }
            let laws = laws.columns(next, BENDS.len());
            next += BENDS.len();
            let mut columns = DMatrix::zeros(rows * direction.len(), laws.ncols());
            for (joint, share) in direction.iter().enumerate().filter(|(_, share)| **share != 0.0) {
                columns.rows_mut(joint * rows, rows).copy_from(&(laws * *share));
            }
            Some(columns)
        });
        Ok(columns.collect())
    }

    /// `directionᵀ q̇` along the motion.
    fn speed(&self, direction: &[f64]) -> DVector<f64> {
        let velocity = &self.subject.motion.velocity;
        let mut speed = DVector::zeros(velocity.nrows());
        for (share, of) in direction.iter().zip(velocity.column_iter()) {
            if *share != 0.0 {
                speed.axpy(*share, &of, 1.0);
            }
        }
        speed
    }

    /// One column per joint, for its delay in s. What is logged at t and acts δ later than stated
    /// is, at the instant where it was thought to act, `τ(t + δ) ≈ τ(t) + δ dτ/dt`.
    pub(super) fn delays(&self) -> Result<DMatrix<f64>, IdentificationError> {
        let rate_hz = self.subject.experiment.sample_rate_hz();
        let rates = self.filtered(&derivatives(&self.torque, rate_hz, "predicted torque")?)?;
        let (rows, joints) = rates.shape();
        let mut columns = DMatrix::zeros(rows * joints, joints);
        for (joint, rate) in rates.column_iter().enumerate() {
            columns.view_mut((joint * rows, joint), (rows, 1)).copy_from(&rate);
        }
        Ok(columns)
    }

    /// The rows of what the estimate predicts along the subject's motion, less those of another.
    /// Without the glitches of the positions, which are no motion that a filter could distort.
    pub(super) fn torque_difference(
        &self,
        other: &Motion,
        reach: usize,
    ) -> Result<DVector<f64>, IdentificationError> {
        let mut difference = &self.torque - torque_along(self.subject, other);
        for k in self.glitches(&difference) {
            let end = k.saturating_add(reach).saturating_add(1).min(difference.nrows());
            difference.rows_range_mut(k.saturating_sub(reach)..end).fill(0.0);
        }
        self.rows_of(&difference)
    }

    /// Of what outliers spoil, the samples where a joint differs by more than it does anywhere else.
    fn glitches(&self, difference: &DMatrix<f64>) -> Vec<usize> {
        if self.subject.spoiled.is_empty() {
            return Vec::new();
        }
        let spoiled = |k: &usize| self.subject.spoiled.iter().any(|range| range.contains(k));
        let counted = self.subject.experiment.counted();
        let (outliers, sound): (Vec<_>, Vec<_>) = counted.partition(spoiled);
        let largest = |joint: usize| {
            sound.iter().fold(0.0, |largest: f64, &k| largest.max(difference[(k, joint)].abs()))
        };
        let largest: Vec<f64> = (0..difference.ncols()).map(largest).collect();
        let glitch = |k: &usize| {
            let joints = difference.row(*k);
            joints.iter().zip(&largest).any(|(value, largest)| value.abs() > *largest)
        };
        outliers.into_iter().filter(glitch).collect()
    }

    /// Torque of the estimate along the whole motion, samples × joints \[N·m\].
    pub(super) fn torque(&self) -> &DMatrix<f64> {
        &self.torque
    }

    /// Torques along the whole motion, samples × joints, filtered and decimated.
    pub(super) fn rows_of(
        &self,
        torque: &DMatrix<f64>,
    ) -> Result<DVector<f64>, IdentificationError> {
        Ok(DVector::from_column_slice(self.filtered(torque)?.as_slice()))
    }

    /// Signals (samples × m) behind the parallel filter, at the rows of one joint.
    fn filtered(&self, signals: &DMatrix<f64>) -> Result<DMatrix<f64>, IdentificationError> {
        let counted = self.subject.experiment.counted();
        let filtered = self.subject.decimation.decimate_columns(signals, counted);
        let filtered = filtered.map_err(IdentificationError::RegressorFilter)?;
        Ok(self.subject.experiment.fitted(self.subject.decimation, filtered))
    }
}

/// The inverse dynamics of the estimate along a motion, samples × joints.
fn torque_along(subject: &Subject<'_>, motion: &Motion) -> DMatrix<f64> {
    let (samples, joints) = motion.position.shape();
    let standard: Vec<_> = subject.standard.iter().map(|&value| Lanes::constant(value)).collect();
    let mut torque = DMatrix::zeros(samples, joints);
    let (mut workspace, mut group) = (Workspace::new(), MotionGroup::of_joints(joints));
    let mut tau = [Lanes::zero(); MAX_JOINTS];
    for first in (0..samples).step_by(GROUP) {
        let [q, dq, ddq] = group.read(motion, first);
        let tau = &mut tau[..joints];
        subject.model.inverse_dynamics(&mut workspace, &standard, q, dq, ddq, tau);
        let inside = GROUP.min(samples - first);
        let mut rows = torque.rows_mut(first, inside);
        for (mut rows, tau) in rows.column_iter_mut().zip(tau) {
            for (row, tau) in rows.iter_mut().zip(tau.0) {
                *row = tau;
            }
        }
    }
    torque
}
