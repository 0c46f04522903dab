//! Cost of physical consistency.

use crate::stored_value::{number, numbers};
use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::feasibility::{
    Estimate, FeasibilityLimits, FixedParameter, Judgement, Outcome, Prior, fit_consistent,
};
use crate::identification::problem::Context;

/// Cost of physically consistent parameters near the nominal ones of the robot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhysicalConsistency {
    /// Judgement of this cost.
    pub judgement: Judgement,
    /// Squared distance between the estimate and the nearest physically consistent parameters, in
    /// the metric of the estimate's covariance and with a negligible weight of the nominal ones.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub cost: f64,
    /// Limit below which the cost of the true bodies stays in 99 % of cases (χ²).
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub cost_limit: f64,
    /// Shift of each parameter to the physically consistent ones, in its standard deviations and
    /// with the default weight of the nominal ones.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub shift_per_parameter: Vec<f64>,
    /// Distance of each link's body from the nominal one \[nats\].
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub divergence_per_link: Vec<f64>,
}

impl PhysicalConsistency {
    /// Returns the physically consistent parameters nearest to the values of the selected
    /// parameters. Returns `None` if the robot file has no nominal parameters, if the selection
    /// lacks parameters that bodies depend on, or if the minimisation fails.
    pub(super) fn nearest_bodies(
        context: &Context<'_>,
        values: &[f64],
        covariance: &DMatrix<f64>,
        fixed: &[FixedParameter],
    ) -> Option<Outcome> {
        let prior = Prior::nominal(context.robot).ok()?;
        let estimate = Estimate { names: context.selection.names(), values, covariance, fixed };
        fit_consistent(
            context.robot,
            context.base,
            &estimate,
            &prior,
            prior.default_weight(),
            &FeasibilityLimits::default(),
        )
        .ok()
    }

    /// Summarises an outcome for the first `parameters` parameters.
    pub(super) fn new(outcome: &Outcome, parameters: usize) -> Self {
        let shifts = outcome.shifts.iter().take(parameters);
        Self {
            judgement: outcome.judgement,
            cost: outcome.least_cost,
            cost_limit: outcome.threshold,
            shift_per_parameter: shifts.map(|shift| shift.deviations).collect(),
            divergence_per_link: outcome.divergence_per_link.clone(),
        }
    }
}
