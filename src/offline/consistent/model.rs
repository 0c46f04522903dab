//! A stored result as parameters that bodies can have.

use std::ops::Range;

use didim_core::feasibility::{
    Estimate, FeasibilityError, Held, Judgement, Outcome, Prior, Shift, consistent,
};
use didim_core::identification::Prediction;
use didim_formats::Measurement;
use nalgebra::DMatrix;

use crate::cell::Cell;
use crate::offline::identify::IdentifyError;
use crate::offline::stored::StoredModel;

/// How well a value is known that was kept at its nominal one, relative to it: as the prior of bodies that CAD states.
const KEPT: f64 = 0.3;

/// A value of nothing that was kept is known to this, in its unit.
const KEPT_AT_ZERO: f64 = 1e-6;

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
    /// No bodies explain the result.
    #[error("{}", infeasible(.0))]
    Infeasible(Box<Outcome>),
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
        let held = |(name, value): &(String, f64)| Held {
            name: name.clone(),
            value: *value,
            deviation: (KEPT * value.abs()).max(KEPT_AT_ZERO),
        };
        let held: Vec<Held> = model.kept.iter().map(held).collect();
        let estimate =
            Estimate { names: &names, values: &values, covariance: &covariance, held: &held };
        let prior = match total_mass_kg {
            Some(mass) => Prior::geometric(&cell.robot, mass)?,
            None => Prior::nominal(&cell.robot)?,
        };
        let weight = prior.default_weight();
        let outcome = consistent(&cell.robot, &cell.base, &estimate, &prior, weight)?;
        if outcome.judgement == Judgement::Infeasible {
            return Err(ConsistentError::Infeasible(Box::new(outcome)));
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

/// What is wrong, the most telling first.
fn infeasible(outcome: &Outcome) -> String {
    let list = |shifts: &[Shift]| {
        let each = shifts.iter().map(|of| format!("{} by {:.1} σ", of.name, of.deviations.abs()));
        each.collect::<Vec<_>>().join(", ")
    };
    let what = match (&outcome.negative[..], outcome.largest_shift()) {
        ([], Some(largest)) => {
            format!("most of all {}", list(core::slice::from_ref(largest)))
        }
        (negative, _) => format!("below 0 are {}", list(negative)),
    };
    format!(
        "no bodies explain the result: their cost is {:.0} where that of true ones stays below {:.0} (χ², 99 %); {what}; look for \
         reversed signs of torques or positions, and for a delay of the torque, before its parameters are used",
        outcome.least_cost, outcome.threshold
    )
}
