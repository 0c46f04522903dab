//! What it costs that the parameters be those of bodies.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::feasibility::{
    Estimate, FeasibilityLimits, FixedParameter, Judgement, Outcome, Prior, consistent,
};
use crate::identification::problem::Context;

/// What it costs that the parameters be those of bodies, near the nominal ones of the robot's file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhysicalConsistency {
    /// What the cost says.
    pub judgement: Judgement,
    /// Squared distance of the nearest bodies from the parameters in their standard deviations,
    /// where the nominal ones hardly count.
    pub cost: f64,
    /// What the cost of true bodies stays below (χ², 99 %).
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
    pub(super) fn nearest(
        context: &Context<'_>,
        values: &[f64],
        covariance: &DMatrix<f64>,
        fixed: &[FixedParameter],
    ) -> Option<Outcome> {
        let prior = Prior::nominal(context.robot).ok()?;
        let estimate = Estimate { names: context.selection.names(), values, covariance, fixed };
        consistent(
            context.robot,
            context.base,
            &estimate,
            &prior,
            prior.default_weight(),
            &FeasibilityLimits::default(),
        )
        .ok()
    }

    /// What a result says of them.
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
