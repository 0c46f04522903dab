//! A stored result as parameters that bodies can have.

use std::ops::Range;

use didim_core::feasibility::{
    Estimate, FeasibilityError, Held, NoBodies, Outcome, Prior, consistent,
};
use didim_core::identification::Prediction;
use didim_formats::Measurement;
use nalgebra::DMatrix;

use crate::cell::Cell;
use crate::offline::identify::IdentifyError;
use crate::offline::stored::StoredModel;

/// Why a result is no model that can be handed on.
#[derive(Debug, thiserror::Error)]
pub enum ConsistentError {
    /// The result is of a version that did not store it.
    #[error(
        "the result has no covariance of its parameters: it is of an earlier version, or was changed; identify again, and give \
         what comes of it"
    )]
    NoCovariance,
    /// No bodies are found, or none of them agree.
    #[error(transparent)]
    Feasibility(#[from] FeasibilityError),
    /// No bodies explain the result. Look at the signs of torques and positions.
    #[error("{0}")]
    NoBodies(NoBodies),
}

/// A stored result, and the consistent parameters nearest to it.
#[derive(Clone, Debug)]
pub struct Consistent<'a> {
    pub(super) cell: &'a Cell,
    pub(super) model: &'a StoredModel,
    pub(super) covariance: DMatrix<f64>,
    /// The consistent parameters, and what they cost.
    pub outcome: Outcome,
}

impl<'a> Consistent<'a> {
    /// The consistent parameters of a result. What decides where the data do not are the nominal bodies of the robot's
    /// file, or where a mass of all moving links is given, its geometry \[kg\].
    ///
    /// # Errors
    /// [`ConsistentError`].
    pub fn of(
        cell: &'a Cell,
        model: &'a StoredModel,
        total_mass_kg: Option<f64>,
    ) -> Result<Self, ConsistentError> {
        let stored = model.covariance.as_ref();
        let covariance = stored.and_then(|stored| stored.matrix(model.parameters.len()));
        let covariance = covariance.ok_or(ConsistentError::NoCovariance)?;
        let (names, values): (Vec<String>, Vec<f64>) = model.parameters.iter().cloned().unzip();
        let held = model.kept.iter().map(|(name, value)| Held::nominal(name.clone(), *value));
        let held: Vec<Held> = held.collect();
        let estimate =
            Estimate { names: &names, values: &values, covariance: &covariance, held: &held };
        let prior = match total_mass_kg {
            Some(mass) => Prior::geometric(&cell.robot, mass)?,
            None => Prior::nominal(&cell.robot)?,
        };
        let weight = prior.default_weight();
        let outcome = consistent(&cell.robot, &cell.base, &estimate, &prior, weight)?;
        if let Some(no_bodies) = outcome.no_bodies() {
            return Err(ConsistentError::NoBodies(no_bodies));
        }
        Ok(Self { cell, model, covariance, outcome })
    }
}

impl Consistent<'_> {
    /// The torques of a measurement as the result predicts them, and as the consistent parameters do. Nothing is fitted.
    ///
    /// # Errors
    /// See [`IdentifyError`].
    pub fn predictions(
        &self,
        measurements: &[(&Measurement, Range<usize>)],
    ) -> Result<[Prediction; 2], IdentifyError> {
        let values = self.cell.base.regroup(&self.outcome.standard());
        let value = |name: &str| self.cell.base.find(name).map(|row| values[row]);
        let moved = |of: &[(String, f64)]| -> Vec<(String, f64)> {
            of.iter().filter_map(|(name, _)| Some((name.clone(), value(name)?))).collect()
        };
        let consistent = StoredModel {
            parameters: moved(&self.model.parameters),
            kept: moved(&self.model.kept),
            uncertainty: None,
            ..self.model.clone()
        };
        Ok([
            self.model.predict(self.cell, measurements)?,
            consistent.predict(self.cell, measurements)?,
        ])
    }
}
