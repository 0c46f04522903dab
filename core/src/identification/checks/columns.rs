//! The columns of what the model does not have, filtered and decimated as its own.

use nalgebra::{DMatrix, DVector};

use super::Subject;
use crate::MAX_JOINTS;
use crate::dynamics::Workspace;
use crate::identification::error::IdentificationError;
use crate::identification::prefilter::Motion;
use crate::signal::central_difference;

/// Speeds at which the tried friction laws bend, as shares of the highest speed of the window.
const BENDS: [f64; 3] = [0.003, 0.02, 0.1];

/// Columns for one subject.
pub(super) struct Columns<'a> {
    subject: &'a Subject<'a>,
    kept: Vec<usize>,
    /// Torque of the estimate along the whole motion, samples × joints \[N·m\].
    torque: DMatrix<f64>,
}

impl<'a> Columns<'a> {
    pub(super) fn new(subject: &'a Subject<'a>) -> Result<Self, IdentificationError> {
        let kept = subject.decimation.kept(subject.experiment.counted()).collect();
        let torque = torque_along(subject, subject.motion);
        Ok(Self { subject, kept, torque })
    }

    /// Friction of other shapes over the speed `u = directionᵀ q̇`, acting in this direction on the
    /// joints: tanh(u/w) for bends w far apart, and u|u|. None where nothing moves.
    ///
    /// Together with the model's own law they come close to any odd law that changes slowly above
    /// the first bend, Stribeck's among them.
    pub(super) fn friction(
        &self,
        direction: &[f64],
    ) -> Result<Option<DMatrix<f64>>, IdentificationError> {
        let velocity = &self.subject.motion.velocity;
        let speed: Vec<f64> = (velocity.row_iter())
            .map(|dq| dq.iter().zip(direction).map(|(dq, s)| dq * s).sum())
            .collect();
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
        let laws = BENDS.map(|bend| -> Vec<f64> {
            speed.iter().map(|u| (u / (bend * highest)).tanh() - sign.value(*u)).collect()
        });
        let mut columns = DMatrix::zeros(self.rows(), laws.len());
        for (law, mut column) in laws.into_iter().zip(columns.column_iter_mut()) {
            let filtered = self.filtered(law)?;
            for (joint, share) in direction.iter().enumerate().filter(|(_, share)| **share != 0.0) {
                column
                    .rows_mut(joint * self.kept.len(), self.kept.len())
                    .axpy(*share, &filtered, 0.0);
            }
        }
        Ok(Some(columns))
    }

    /// One column per joint, for its delay in s: `τ(t − δ) ≈ τ(t) − δ dτ/dt`.
    pub(super) fn delays(&self) -> Result<DMatrix<f64>, IdentificationError> {
        let joints = self.torque.ncols();
        let mut columns = DMatrix::zeros(self.rows(), joints);
        for joint in 0..joints {
            let torque: Vec<f64> = self.torque.column(joint).iter().copied().collect();
            let rate = central_difference(&torque, self.subject.experiment.sample_rate_hz())
                .map_err(|cause| IdentificationError::Signal {
                    signal: "predicted torque",
                    joint: joint + 1,
                    cause,
                })?;
            let filtered = self.filtered(rate)?;
            let mut part = columns.view_mut((joint * self.kept.len(), joint), (self.kept.len(), 1));
            part.copy_from(&(-filtered));
        }
        Ok(columns)
    }

    /// The rows of what the estimate predicts along the subject's motion, less those of another.
    pub(super) fn torque_difference(
        &self,
        other: &Motion,
    ) -> Result<DVector<f64>, IdentificationError> {
        self.rows_of(&(&self.torque - torque_along(self.subject, other)))
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
        let mut rows = Vec::with_capacity(self.rows());
        for column in torque.column_iter() {
            rows.extend(self.filtered(column.iter().copied().collect())?.iter());
        }
        Ok(DVector::from_vec(rows))
    }

    /// Rows of all joints.
    fn rows(&self) -> usize {
        self.kept.len() * self.torque.ncols()
    }

    /// A signal behind the parallel filter, at the rows of one joint.
    fn filtered(&self, mut signal: Vec<f64>) -> Result<DVector<f64>, IdentificationError> {
        let failed = IdentificationError::RegressorFilter;
        self.subject.decimation.filter(&mut signal).map_err(failed)?;
        let rows = self.kept.iter().filter_map(|&k| signal.get(k)).copied();
        Ok(DVector::from_iterator(self.kept.len(), rows))
    }
}

/// The inverse dynamics of the estimate along a motion, samples × joints.
fn torque_along(subject: &Subject<'_>, motion: &Motion) -> DMatrix<f64> {
    let (samples, joints) = motion.position.shape();
    let mut torque = DMatrix::zeros(samples, joints);
    let mut workspace = Workspace::new();
    let [mut q, mut dq, mut ddq, mut tau] = [[0.0; MAX_JOINTS]; 4];
    for k in 0..samples {
        for (values, signal) in [
            (&mut q, &motion.position),
            (&mut dq, &motion.velocity),
            (&mut ddq, &motion.acceleration),
        ] {
            for (value, entry) in values.iter_mut().zip(signal.row(k).iter()) {
                *value = *entry;
            }
        }
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
