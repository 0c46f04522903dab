//! What two results of one arm say differently of the torques along a motion.

use std::ops::Range;

use didim_core::identification::{TorqueAlong, torque_along};
use didim_formats::Measurement;
use serde::Serialize;

use super::identify::{IdentifyError, joined};
use super::stored::StoredModel;
use crate::cell::Cell;

/// Why two results have no torques to compare.
#[derive(Debug, thiserror::Error)]
pub enum TorqueDifferenceError {
    /// The recording is no experiment of this robot.
    #[error(transparent)]
    Measurement(#[from] IdentifyError),
    /// Their torques are not behind the same filters.
    #[error(
        "the two results were identified behind different filters, so that their torques have no rows in common; identify \
         both with the same cut-off and decimation"
    )]
    Filters,
}

/// What two results say differently of the torque of a joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointDifference {
    /// Number of the joint, from 1.
    pub joint: usize,
    /// `N·m`, or `N` of a prismatic joint: of all but the time and the share.
    pub unit: &'static str,
    /// Root mean square of the difference.
    pub rms: f64,
    /// What that would be by the statistical uncertainty of both results alone; null where one does not have it.
    pub by_chance: Option<f64>,
    /// The largest difference, later result minus earlier one.
    pub largest: f64,
    /// When that is, since the first sample \[s\].
    pub at_s: f64,
    /// Root mean square of the difference relative to that of the torque by the earlier result.
    pub relative: f64,
}

/// What a later result says differently from an earlier one of the torques along recordings, of which the samples in each
/// range count. Each result comes with the cell that it [was read with](StoredModel::read).
///
/// # Errors
/// [`TorqueDifferenceError`].
pub fn torque_difference(
    results: [(&StoredModel, &Cell); 2],
    measurements: &[(&Measurement, Range<usize>)],
) -> Result<Vec<JointDifference>, TorqueDifferenceError> {
    let [(then, earlier), (now, later)] = results;
    let [then, now] = [then.along(earlier, measurements)?, now.along(later, measurements)?];
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
            let of = |result: &TorqueAlong| {
                Some(self::rms(result.standard_deviation.as_ref()?[joint].iter().copied()))
            };
            JointDifference {
                joint: joint + 1,
                unit: described.kind.torque_unit(),
                rms,
                by_chance: of(&then).zip(of(&now)).map(|(then, now)| then.hypot(now)),
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
    fn along(
        &self,
        cell: &Cell,
        measurements: &[(&Measurement, Range<usize>)],
    ) -> Result<TorqueAlong, IdentifyError> {
        let experiment = joined(cell, measurements)?;
        let named = self.named();
        let arm = self.known(&named);
        Ok(torque_along(&cell.robot, &cell.base, &experiment, &cell.options, arm)?)
    }
}
