//! Part of the model residual that friction hysteresis at reversals explains.

use nalgebra::{DMatrix, DVector};

use super::checks::FittedModel;
use crate::identification::observation::hysteresis_along;
use crate::identification::problem::IdentificationError;
use didim_dynamics::robot::Hysteresis;

/// Presliding distance, as a share of a joint's range or of a full turn, whichever is smaller.
const WAY: f64 = 0.002;

impl FittedModel<'_> {
    /// Returns the root mean square of each joint's residual torque \[N·m or N\], without the part
    /// that hysteresis explains. That part is no error of the motion. `residuals` are the residuals
    /// (r).
    pub(super) fn left_but_for_lag(
        &self,
        residuals: &DVector<f64>,
    ) -> Result<Vec<f64>, IdentificationError> {
        let changes = self.changes_by_lag()?;
        let rows = self.observations.rows_per_joint();
        let mut left = self.observations.rms_per_joint(residuals);
        for (joint, left) in left.iter_mut().enumerate() {
            let of_joint = joint * rows..(joint + 1) * rows;
            let mut lags = DVector::zeros(residuals.len());
            lags.rows_range_mut(of_joint.clone()).copy_from(&changes.column(joint));
            lags -=
                self.observations.matrix().times_parameters(&self.analysis.estimate_shift(&lags));
            let [own, lags] = [residuals, &lags].map(|of| of.rows_range(of_joint.clone()));
            // Friction that leads would be another error.
            let squares = lags.norm_squared();
            if squares > 0.0 {
                let share = (own.dot(&lags) / squares).max(0.0);
                *left = (own - lags * share).norm() / (rows as f64).sqrt();
            }
        }
        Ok(left)
    }

    /// Returns the torque change by the hysteresis of a unit of Coulomb friction, a column for each
    /// joint.
    fn changes_by_lag(&self) -> Result<DMatrix<f64>, IdentificationError> {
        let Self { context, motion, .. } = self;
        let ranges = context.robot.limits();
        let ways = ranges
            .map(|of| WAY * (of.position_max - of.position_min).min(core::f64::consts::TAU))
            .collect();
        let ends = context.experiment.ends();
        let stands =
            hysteresis_along(Some(Hysteresis::new(ways)), &ends, |k| motion.position_at(k));
        let mut read = |sample: usize, changes: &mut [f64]| {
            for (joint, change) in changes.iter_mut().enumerate() {
                let speed = motion.velocity(sample, joint);
                let sign: f64 = context.robot.sign_model(joint).value(speed);
                *change = stands[sample][joint] - sign;
            }
        };
        let rows = context.decimate_samples(context.robot.joints(), &mut read);
        rows.map_err(IdentificationError::RegressorFilter)
    }
}
