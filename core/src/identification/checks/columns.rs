//! The columns of what the model does not have, filtered and decimated as its own.

use nalgebra::{DMatrix, DVector};

use super::Subject;
use crate::MAX_JOINTS;
use crate::dynamics::Workspace;
use crate::identification::error::IdentificationError;
use crate::identification::prefilter::Motion;
use crate::scalar::Scalar;
use crate::signal::central_difference;

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
    /// joints: tanh(u/w) less the model's own sign function, for bends w far apart. None where
    /// nothing moves.
    ///
    /// Above the last bend all of them vanish: what the model calls Coulomb friction stays what it
    /// is there, and moves only as far as the shape below is another.
    pub(super) fn friction(
        &self,
        direction: &[f64],
    ) -> Result<Option<DMatrix<f64>>, IdentificationError> {
        let speed = &self.subject.motion.velocity * DVector::from_column_slice(direction);
        let highest = self
            .subject
            .experiment
            .counted()
            .filter_map(|k| speed.get(k))
            .fold(0.0, |highest: f64, speed| highest.max(speed.abs()));
        if highest <= 0.0 {
            return Ok(None);
        }
        let sign = self.subject.robot.sign_model();
        let counted = self.subject.experiment.counted();
        let laws =
            self.subject.decimation.decimate(speed.len(), BENDS.len(), counted, |k, laws| {
                let u = speed[k];
                let mut bent = BENDS.map(|bend| u / (bend * highest));
                f64::tanh_each(&mut bent);
                let model = sign.value(u);
                for (law, bent) in laws.iter_mut().zip(bent) {
                    *law = bent - model;
                }
            });
        let laws = laws.map_err(IdentificationError::RegressorFilter)?;
        let laws = self.subject.experiment.fitted(self.subject.decimation, laws);
        let rows = laws.nrows();
        let mut columns = DMatrix::zeros(rows * direction.len(), laws.ncols());
        for (joint, share) in direction.iter().enumerate().filter(|(_, share)| **share != 0.0) {
            columns.rows_mut(joint * rows, rows).copy_from(&(&laws * *share));
        }
        Ok(Some(columns))
    }

    /// One column per joint, for its delay in s. What is logged at t and acts δ later than stated
    /// is, at the instant where it was thought to act, `τ(t + δ) ≈ τ(t) + δ dτ/dt`.
    pub(super) fn delays(&self) -> Result<DMatrix<f64>, IdentificationError> {
        let rate_hz = self.subject.experiment.sample_rate_hz();
        let mut rates = self.torque.clone();
        for (joint, mut torque) in (1..).zip(rates.column_iter_mut()) {
            let signal = "predicted torque";
            let rate = central_difference(torque.as_slice(), rate_hz)
                .map_err(|cause| IdentificationError::Signal { signal, joint, cause })?;
            torque.copy_from_slice(&rate);
        }
        let rates = self.filtered(&rates)?;
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
    let mut torque = DMatrix::zeros(samples, joints);
    let mut workspace = Workspace::new();
    let mut tau = [0.0; MAX_JOINTS];
    for k in 0..samples {
        let [q, dq, ddq] = motion.at(k);
        subject.model.inverse_dynamics(
            &mut workspace,
            subject.standard,
            &q[..joints],
            &dq[..joints],
            &ddq[..joints],
            &mut tau[..joints],
        );
        for (entry, tau) in torque.row_mut(k).iter_mut().zip(&tau) {
            *entry = *tau;
        }
    }
    torque
}
