//! Torque difference of two results of one arm along a motion.

use didim_dynamics::robot::JointIndex;
use std::ops::Range;

use didim_formats::Measurement;
use didim_identification::identification::{TorqueAlong, torque_along};
use serde::Serialize;

use super::identify::{IdentifyError, join_measurements};
use super::stored_model::StoredModel;
use crate::cell::Cell;

/// Error when two results have no comparable torques.
#[derive(Debug, thiserror::Error)]
pub enum TorqueDifferenceError {
    /// The recording does not fit this robot as an experiment.
    #[error(transparent)]
    Measurement(#[from] IdentifyError),
    /// The two results were identified with different filters, so their torque rows cannot be
    /// compared.
    #[error(
        "the two results were identified with different filters, so their rows cannot be \
            compared; identify both with the same cut-off and decimation"
    )]
    Filters,
}

/// Difference of two results in a joint torque.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointDifference {
    /// Number of the joint.
    pub joint: JointIndex,
    /// Name of the joint in the robot file. `None` if it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_name: Option<String>,
    /// Unit of all values except the time and the ratio: `N·m`, or `N` of a prismatic joint.
    pub unit: &'static str,
    /// Root mean square of the difference.
    pub rms: f64,
    /// Root mean square expected from the statistical uncertainty of both results alone. `None` if
    /// a result has no statistical uncertainty.
    pub by_chance: Option<f64>,
    /// Largest difference: later result minus earlier result.
    pub largest: f64,
    /// Time of the largest difference, since the first sample \[s\].
    pub at_s: f64,
    /// Root mean square of the difference relative to that of the torque from the earlier result.
    pub relative: f64,
}

/// Computes the torque difference of a later and an earlier result along recordings. Uses only the
/// samples in each range. Each result comes with the cell that [`StoredModel::read_stored_model`]
/// returned.
///
/// # Errors
/// [`TorqueDifferenceError`].
pub fn torque_difference(
    results: [(&StoredModel, &Cell); 2],
    measurements: &[(&Measurement, Range<usize>)],
) -> Result<Vec<JointDifference>, TorqueDifferenceError> {
    let [(then, earlier), (now, later)] = results;
    let [then, now] = [
        then.torque_along_model(earlier, measurements)?,
        now.torque_along_model(later, measurements)?,
    ];
    if then.time_s != now.time_s {
        return Err(TorqueDifferenceError::Filters);
    }
    let chain = earlier.robot.chain().iter().enumerate();
    Ok(chain
        .map(|(joint, described)| {
            let differences = now.torque[joint].iter().zip(&then.torque[joint]).map(|(b, a)| b - a);
            let largest = differences.clone().zip(&now.time_s);
            let largest = largest.max_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs()));
            let (largest, at_s) = largest.map_or((0.0, 0.0), |(value, time)| (value, *time));
            let rms = rms(differences);
            let rms_of = |result: &TorqueAlong| {
                Some(self::rms(result.standard_deviation.as_ref()?[joint].iter().copied()))
            };
            JointDifference {
                joint: JointIndex::new(joint),
                joint_name: earlier.robot.joint_name(JointIndex::new(joint)).map(str::to_owned),
                unit: described.kind.torque_unit(),
                rms,
                by_chance: rms_of(&then).zip(rms_of(&now)).map(|(then, now)| then.hypot(now)),
                largest,
                at_s,
                relative: rms / self::rms(then.torque[joint].iter().copied()),
            }
        })
        .collect())
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) =
        values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

impl StoredModel {
    fn torque_along_model(
        &self,
        cell: &Cell,
        measurements: &[(&Measurement, Range<usize>)],
    ) -> Result<TorqueAlong, IdentifyError> {
        let experiment = join_measurements(cell, measurements)?;
        let named = self.named_parameters();
        let arm = self.known_arm(&named);
        Ok(torque_along(&cell.robot, &cell.base, &experiment, &cell.options, arm)?)
    }
}
