//! A stored result as physically consistent parameters.

use std::ops::Range;

use didim_dynamics::robot::TorqueTerm;
use didim_formats::Measurement;
use didim_identification::feasibility::{
    Estimate, FeasibilityError, FeasibilityLimits, FixedParameter, Outcome, PhysicallyImpossible,
    Prior, fit_consistent,
};
use didim_identification::identification::Prediction;
use nalgebra::DMatrix;

use crate::analysis::identify::IdentifyError;
use crate::analysis::stored_model::StoredModel;
use crate::cell::Cell;

/// Error when a result gives no model to export.
#[derive(Debug, thiserror::Error)]
pub enum ConsistentError {
    /// The result comes from a version that did not store the covariance.
    #[error(
        "the result has no covariance of its parameters: it is from an earlier version, or was \
            changed; identify again, and give the new result"
    )]
    NoCovariance,
    /// No physically consistent parameters can be computed, for example because there is no prior.
    #[error(transparent)]
    Feasibility(#[from] FeasibilityError),
    /// The recorded torques lack joints or gravity, so the model lacks them too. Identify from
    /// complete torques.
    #[error(
        "the result is from torques without {missing}, and a model for other programs needs it; \
         identify from torques that contain it (`excludes` and `joints` of the cell)"
    )]
    IncompleteTorque {
        /// Joints and terms that the recorded torques do not contain.
        missing: String,
    },
    /// No physically consistent parameters explain the result. Check the signs of torques and
    /// positions.
    #[error("{0}")]
    PhysicallyImpossible(PhysicallyImpossible),
}

/// A stored result, and the physically consistent parameters nearest to it.
#[derive(Clone, Debug)]
pub struct ConsistentModel<'a> {
    pub(super) cell: &'a Cell,
    pub(super) model: &'a StoredModel,
    pub(super) covariance: DMatrix<f64>,
    /// The consistent parameters, and their cost.
    pub outcome: Outcome,
}

impl<'a> ConsistentModel<'a> {
    /// Computes the consistent parameters of a result. Where the data do not determine the
    /// parameters, the prior from the robot file's nominal parameters does. If the total mass of
    /// all moving links is given \[kg\], the prior comes from the file's geometry instead.
    ///
    /// # Errors
    /// [`ConsistentError`].
    pub fn from_result(
        cell: &'a Cell,
        model: &'a StoredModel,
        total_mass_kg: Option<f64>,
    ) -> Result<Self, ConsistentError> {
        let recorded = cell.robot.recorded_torque();
        let joints = recorded.missing_joints().iter().map(|joint| format!("joint {joint}"));
        let gravity = recorded.excluded_terms().iter().filter(|of| **of == TorqueTerm::Gravity);
        let missing: Vec<String> = joints.chain(gravity.map(ToString::to_string)).collect();
        if !missing.is_empty() {
            return Err(ConsistentError::IncompleteTorque { missing: missing.join(", ") });
        }
        let stored = model.covariance.as_ref();
        let covariance = stored.and_then(|stored| stored.matrix(model.parameters.len()));
        let covariance = covariance.ok_or(ConsistentError::NoCovariance)?;
        let (names, values): (Vec<String>, Vec<f64>) = model.parameters.iter().cloned().unzip();
        let fixed = model
            .fixed_parameters
            .iter()
            .map(|(name, value)| FixedParameter::at_nominal(name.clone(), *value));
        let fixed: Vec<FixedParameter> = fixed.collect();
        let estimate =
            Estimate { names: &names, values: &values, covariance: &covariance, fixed: &fixed };
        let prior = match total_mass_kg {
            Some(mass) => Prior::geometric(&cell.robot, mass)?,
            None => Prior::nominal(&cell.robot)?,
        };
        let weight = prior.default_weight();
        let outcome = fit_consistent(
            &cell.robot,
            &cell.base,
            &estimate,
            &prior,
            weight,
            &FeasibilityLimits::default(),
        )?;
        if let Some(no_bodies) = outcome.no_bodies() {
            return Err(ConsistentError::PhysicallyImpossible(no_bodies));
        }
        Ok(Self { cell, model, covariance, outcome })
    }
}

impl ConsistentModel<'_> {
    /// Predicts the torques of a measurement, once with the result and once with the consistent
    /// parameters. Fits nothing.
    ///
    /// # Errors
    /// See [`IdentifyError`].
    pub fn predict_both(
        &self,
        measurements: &[(&Measurement, Range<usize>)],
    ) -> Result<[Prediction; 2], IdentifyError> {
        let values = self.cell.base.to_base(&self.outcome.standard_values());
        let value = |name: &str| self.cell.base.find(name).map(|row| values[row]);
        let renamed = |of: &[(String, f64)]| -> Vec<(String, f64)> {
            of.iter().filter_map(|(name, _)| Some((name.clone(), value(name)?))).collect()
        };
        let consistent = StoredModel {
            parameters: renamed(&self.model.parameters),
            fixed_parameters: renamed(&self.model.fixed_parameters),
            uncertainty: None,
            ..self.model.clone()
        };
        Ok([
            self.model.predict(self.cell, measurements)?,
            consistent.predict(self.cell, measurements)?,
        ])
    }
}
