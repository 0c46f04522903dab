//! Cost of physical consistency.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::feasibility::{
    Estimate, FeasibilityLimits, FixedParameter, Judgement, Outcome, Prior, fit_consistent,
};
use crate::identification::problem::Context;

/// Cost of physically consistent parameters near the nominal ones of the robot file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhysicalConsistency {
    /// Judgement of the cost.
    pub judgement: Judgement,
    /// Squared distance of the nearest bodies from the parameters in their standard deviations,
    /// where the nominal ones hardly count.
    pub cost: f64,
    /// Limit that the cost of true bodies stays below (χ², 99 %).
    pub cost_limit: f64,
    /// By how much bodies move each parameter, in its standard deviations, where the nominal ones
    /// count.
    pub shift_per_parameter: Vec<f64>,
    /// Distance of each link's body from the nominal one \[nats\].
    pub divergence_per_link: Vec<f64>,
}

impl PhysicalConsistency {
    /// The bodies nearest to the values of the selected parameters; none where the robot's file
    /// states no nominal ones, where the selection leaves out what bodies have, or where the
    /// nearest are not found.
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

    /// Summarises an outcome.
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
