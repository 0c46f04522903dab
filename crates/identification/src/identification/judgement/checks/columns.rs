//! Torques along another motion than the filtered one, filtered and decimated like those of the
//! model.

use nalgebra::{DMatrix, DVector};

use super::FittedModel;
use crate::identification::observation::{FilteredPositions, InverseDynamics, MotionGroup};
use crate::identification::problem::IdentificationError;
use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::numeric::{Lanes, Scalar, WIDTH};

impl FittedModel<'_> {
    /// Returns the rows of the torques that the estimate predicts along the motion, minus those
    /// along the `other` positions. Within `reach` samples of a glitch the difference is 0, because
    /// a glitch is no motion that a filter could distort.
    pub(super) fn torque_difference(
        &self,
        other: &FilteredPositions,
        reach: usize,
    ) -> Result<DVector<f64>, IdentificationError> {
        let (samples, joints) = self.motion.position.shape();
        let mut silenced = vec![false; samples];
        for k in self.glitches(other) {
            let end = k.saturating_add(reach).saturating_add(1).min(samples);
            silenced[k.saturating_sub(reach)..end].fill(true);
        }
        let mut group = MotionGroup::of_joints(joints);
        let mut dynamics = InverseDynamics::of_the_estimate(self.context, self.parameters);
        let model = &self.context.model;
        let rows = self.context.decimate_signals(joints, &mut |first, torques| {
            let torque = dynamics.torque(model, group.states_from_positions(other, first));
            torques.copy_from_slice(&torque[..joints]);
            let silenced = &silenced[first..samples.min(first + WIDTH)];
            if silenced.contains(&true) {
                let torque = dynamics.torque(model, group.read(self.motion, first));
                for (l, _) in silenced.iter().enumerate().filter(|(_, silenced)| **silenced) {
                    for (other, torque) in torques.iter_mut().zip(torque) {
                        other.0[l] = torque.0[l];
                    }
                }
            }
        });
        let rows = rows.map_err(IdentificationError::RegressorFilter)?;
        let mut difference = self.predicted();
        difference.iter_mut().zip(rows.as_slice()).for_each(|(to, other)| *to -= other);
        Ok(difference)
    }

    /// Returns the samples of outliers where the torque difference of a joint exceeds its largest
    /// difference at all other samples.
    fn glitches(&self, other: &FilteredPositions) -> Vec<usize> {
        if self.outliers.is_empty() {
            return Vec::new();
        }
        let (samples, joints) = self.motion.position.shape();
        let mut group = MotionGroup::of_joints(joints);
        let mut dynamics = InverseDynamics::of_the_estimate(self.context, self.parameters);
        let model = &self.context.model;
        let difference = read_signals(samples, joints, |first, difference| {
            let torque = dynamics.torque(model, group.read(self.motion, first));
            difference.copy_from_slice(&torque[..joints]);
            let torque = dynamics.torque(model, group.states_from_positions(other, first));
            for (difference, torque) in difference.iter_mut().zip(torque) {
                *difference -= torque;
            }
        });
        let outlier = |k: &usize| self.outliers.iter().any(|range| range.contains(k));
        let counted = self.context.experiment.counted_samples();
        let (outliers, sound): (Vec<_>, Vec<_>) = counted.partition(outlier);
        let largest = |joint: usize| {
            sound.iter().fold(0.0, |largest: f64, &k| largest.max(difference[(k, joint)].abs()))
        };
        let largest: Vec<f64> = (0..joints).map(largest).collect();
        outliers
            .into_iter()
            .filter(|k: &usize| {
                let joints = difference.row(*k);
                joints.iter().zip(&largest).any(|(value, largest)| value.abs() > *largest)
            })
            .collect()
    }
}

/// Returns the signals of the joints over all samples (samples × joints). `read` writes them in
/// groups, starting at a given sample.
fn read_signals(
    samples: usize,
    joints: usize,
    mut read: impl FnMut(usize, &mut [Group]),
) -> DMatrix<f64> {
    let mut signals = DMatrix::zeros(samples, joints);
    let mut group = [Lanes::zero(); MAX_JOINTS];
    for first in (0..samples).step_by(WIDTH) {
        read(first, &mut group[..joints]);
        let mut rows = signals.rows_mut(first, WIDTH.min(samples - first));
        for (mut rows, values) in rows.column_iter_mut().zip(&group) {
            for (row, value) in rows.iter_mut().zip(values.0) {
                *row = value;
            }
        }
    }
    signals
}
