//! Consistent standard parameters, their sources and their costs.

use serde::Serialize;

use super::body::Body;
use super::judgement::{Judgement, Shift};
use super::prior::PriorSource;

/// Source of the value of a standard parameter. It depends on the regrouping only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueSource {
    /// Data: the parameter is a base parameter by itself, identified or fixed.
    Data,
    /// Prior, and indirectly data about other parameters of the same body. No torque depends on the
    /// parameter.
    Prior,
    /// The data determine only a sum with other parameters; the prior determines how it is split.
    Combination,
    /// The identified model does not contain the parameter, and its value is 0.
    Absent,
}

/// Standard parameter of the outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardParameter {
    /// Its name.
    pub name: String,
    /// Value \[SI\]. If the class is [`ValueSource::Prior`], it is that of the prior or close to
    /// it.
    pub value: f64,
    /// Posterior standard deviation √Var(θ; H⁻¹) from data and prior together.
    pub deviation: f64,
    /// Source of the value. Report it together with the value, because data alone hardly limit
    /// masses.
    pub class: ValueSource,
    /// Share of the prior's variance that the data remove, 0 to 1. High shares with the class
    /// [`ValueSource::Prior`] are due to the prior body.
    pub share_of_data: f64,
}

/// Minimum of J + λ (Σ D + Σ d).
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// All standard parameters in the order of the regressor's columns.
    pub parameters: Vec<StandardParameter>,
    /// Body of each link.
    pub link_bodies: Vec<Body>,
    /// Smallest eigenvalue of each link's pseudo-inertia relative to that of the prior; positive.
    pub smallest_eigenvalues: Vec<f64>,
    /// Source of the prior.
    pub prior: PriorSource,
    /// Weight λ.
    pub weight: f64,
    /// Objective F = J + λ (Σ D + Σ d).
    pub objective: f64,
    /// Cost J: the squared distance from the estimate in the metric of its covariance.
    pub cost: f64,
    /// Cost J with a negligible prior (λ = 0.03), about one above the smallest cost of any bodies.
    /// The weight is larger if J already shows that no bodies within 300 nats of the prior explain
    /// the estimate.
    pub least_cost: f64,
    /// Limit χ² at 99 %, below which the cost of the true bodies stays.
    pub threshold: f64,
    /// Distance D of each link from the prior \[nats\].
    pub divergence_per_link: Vec<f64>,
    /// Distance Σ d of friction and drive inertias from the prior \[nats\].
    pub divergence_of_drives: f64,
    /// Effective number of base parameters that the data determine.
    pub effective_parameters: f64,
    /// Shift of each row from the estimate to the bodies: identified base parameters first, then
    /// fixed ones.
    pub shifts: Vec<Shift>,
    /// Friction and drive inertias that are more than 3 σ below 0 in the estimate. If the estimate
    /// is infeasible, report them first.
    pub negative_parameters: Vec<Shift>,
    /// Judgement whether bodies explain the estimate.
    pub judgement: Judgement,
    /// Number of Newton steps.
    pub steps: usize,
}

impl Outcome {
    /// Returns the base parameter with the largest shift.
    pub fn largest_shift(&self) -> Option<&Shift> {
        self.shifts.iter().max_by(|a, b| a.deviations.abs().total_cmp(&b.deviations.abs()))
    }

    /// Returns the values of all standard parameters, in the order of the regressor's columns.
    pub fn standard_values(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.value).collect()
    }
}
