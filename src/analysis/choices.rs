//! Choices that a cell leaves to the data, made before the method runs.

use std::ops::Range;

use didim_dynamics::dynamics::BaseParametersError;
use didim_formats::Measurement;
use didim_identification::identification::{ChosenCutoff, ChosenFriction, Estimate};

use super::identify::{IdentifyError, choose_cutoff_from, choose_friction_from};
use crate::cell::Cell;

/// Error when a choice fails.
#[derive(Debug, thiserror::Error)]
pub enum ChoiceError {
    /// A trial identification failed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The chosen friction laws leave no base parameters to distinguish.
    #[error(transparent)]
    BaseParameters(#[from] BaseParametersError),
}

/// A choice that is left to the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The cut-off of the position filter.
    Cutoff,
    /// The friction laws.
    Friction,
}

/// Values that were chosen from the data. An entry is `None` if the cell configures the value.
#[derive(Clone, Debug, Default)]
pub struct DataChoices {
    /// The cut-off of the position filter.
    pub cutoff: Option<ChosenCutoff>,
    /// The friction laws.
    pub friction: Option<ChosenFriction>,
    /// Parameters of the chosen friction laws that were not in the cell's list of parameters, if it
    /// has such a list.
    pub added_parameters: Vec<String>,
}

impl DataChoices {
    /// Chooses the values that the cell leaves to the data, and writes them into the cell. Calls
    /// `tried` after each trial identification.
    ///
    /// # Errors
    /// [`ChoiceError`].
    pub fn make_choices(
        cell: &mut Cell,
        measurements: &[(&Measurement, Range<usize>)],
        mut tried: impl FnMut(Choice),
    ) -> Result<Self, ChoiceError> {
        let mut choices = Self::default();
        if cell.chooses_cutoff {
            let chosen = choose_cutoff_from(cell, measurements, || tried(Choice::Cutoff))?;
            cell.options.position_filter.cutoff_hz = chosen.cutoff_hz;
            choices.cutoff = Some(chosen);
        }
        // The friction laws are chosen after the cut-off, because their choice uses the filtered
        // motion.
        if cell.chooses_friction {
            let chosen = choose_friction_from(cell, measurements, || tried(Choice::Friction))?;
            let listed = cell.options.parameters.clone().unwrap_or_default();
            *cell = cell.clone().with_friction(chosen.friction.clone())?;
            let laws = cell.options.parameters.iter().flatten();
            choices.added_parameters =
                laws.filter(|name| !listed.contains(name)).cloned().collect();
            choices.friction = Some(chosen);
        }
        Ok(choices)
    }

    /// Adds the choices to the estimate, because later uses of the result need them.
    pub fn write_to_estimate(&self, estimate: &mut Estimate) {
        if self.friction.is_some() {
            // Notes about friction laws no longer apply, because the friction laws were chosen from
            // the data.
            estimate.verdict.notes.retain(|note| !note.is_about_friction_laws());
        }
        if self.cutoff.is_some() {
            // None of the others predicts better by more than the tolerance of the choice.
            estimate.verdict.notes.retain(|note| !note.is_about_cutoff());
        }
        estimate.position_cutoff.clone_from(&self.cutoff);
        estimate.friction.clone_from(&self.friction);
    }
}
