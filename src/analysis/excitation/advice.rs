//! Insufficient parameters of a stored result, and the motions that improve them.

use didim_identification::excitation::{Advice, ExcitationError, advise};
use didim_identification::identification::ReachedRange;

use super::assignment::Assignment;
use crate::analysis::stored_model::{JudgedUse, StoredModel};
use crate::cell::Cell;
use crate::threads::Threads;

/// Advice, and the data that its numbers refer to.
#[derive(Clone, Debug)]
pub struct AdviceForResult {
    /// Insufficient parameters, and the motions that improve them.
    pub advice: Advice,
    /// Range of the result's motion, per joint; empty if the result does not report it.
    pub reached_per_joint: Vec<ReachedRange>,
    /// Parameters whose statistical uncertainty alone is sufficient, but whose combined uncertainty
    /// is not. Each entry is the parameter's index and its combined uncertainty relative to the
    /// value.
    pub not_by_noise: Vec<(usize, f64)>,
    /// Verdict for each use, if the result has one.
    pub uses: Vec<JudgedUse>,
    /// Sufficient uncertainty of a parameter, relative to its value.
    pub sufficient_uncertainty: f64,
}

impl AdviceForResult {
    /// Creates the advice for a result of a cell. The assignment must be that of this cell and
    /// result.
    ///
    /// # Errors
    /// [`ExcitationError`].
    pub fn new(
        cell: &Cell,
        result: &StoredModel,
        assignment: &Assignment,
    ) -> Result<Self, ExcitationError> {
        let enough = cell.options.limits.parameter_uncertainty;
        let parameters = &assignment.parameters;
        let values: Vec<f64> = parameters.iter().map(|of| of.value.unwrap_or(f64::NAN)).collect();
        let combined = parameters.iter().map(|of| {
            let k = result.parameters.iter().position(|(name, _)| *name == of.name)?;
            result.combined_deviations.get(k).copied().flatten()
        });
        let advice = advise(&cell.robot, &assignment.task, &values, enough, &Threads::ALL)?;
        let joints = cell.robot.joints();
        let has_all_joints = result.reached.len() == joints;
        let relative = |k: usize, deviation: f64| deviation / values[k].abs();
        let not_by_noise = (combined.enumerate())
            .filter(|(k, _)| relative(*k, advice.deviations[*k]) <= enough)
            .filter_map(|(k, combined)| Some((k, relative(k, combined?))))
            .filter(|(_, combined)| *combined > enough)
            .collect();
        Ok(Self {
            advice,
            reached_per_joint: if has_all_joints { result.reached.clone() } else { Vec::new() },
            not_by_noise,
            uses: result.uses.clone(),
            sufficient_uncertainty: enough,
        })
    }
}
