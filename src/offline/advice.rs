//! What a stored result lacks, and which motions bring it.

use didim_core::excitation::{Advice, ExcitationError, advise};
use didim_core::identification::Reached;

use super::excitation::Assignment;
use super::stored::{JudgedUse, StoredModel};
use crate::cell::Cell;

/// Advice, with what its numbers are about.
#[derive(Clone, Debug)]
pub struct Advised {
    /// What is lacking, and what brings it.
    pub advice: Advice,
    /// How far the result's motion went, per joint; empty where it does not say.
    pub reached: Vec<Reached>,
    /// Parameters that noise leaves certain enough and all that is stated and assumed does not, by their place, with
    /// their combined uncertainty relative to the value.
    pub not_by_noise: Vec<(usize, f64)>,
    /// The verdict for each use, where the result has one.
    pub uses: Vec<JudgedUse>,
    /// What is enough for a parameter, relative to its value.
    pub enough: f64,
}

impl Advised {
    /// Of a result of a cell; the assignment is that of both.
    ///
    /// # Errors
    /// [`ExcitationError`].
    pub fn new(
        cell: &Cell,
        result: &StoredModel,
        assignment: &Assignment,
    ) -> Result<Self, ExcitationError> {
        let enough = cell.options.limits.parameter_uncertainty;
        let own = &assignment.parameters;
        let values: Vec<f64> = own.iter().map(|of| of.value.unwrap_or(f64::NAN)).collect();
        let combined = own.iter().map(|of| {
            let k = result.parameters.iter().position(|(name, _)| *name == of.name)?;
            result.combined.get(k).copied().flatten()
        });
        let advice = advise(&cell.robot, &assignment.task, &values, enough)?;
        let joints = cell.robot.joints();
        let whole = result.reached.len() == joints;
        let relative = |k: usize, deviation: f64| deviation / values[k].abs();
        let not_by_noise = (combined.enumerate())
            .filter(|(k, _)| relative(*k, advice.deviations[*k]) <= enough)
            .filter_map(|(k, combined)| Some((k, relative(k, combined?))))
            .filter(|(_, combined)| *combined > enough)
            .collect();
        Ok(Self {
            advice,
            reached: if whole { result.reached.clone() } else { Vec::new() },
            not_by_noise,
            uses: result.uses.clone(),
            enough,
        })
    }
}
