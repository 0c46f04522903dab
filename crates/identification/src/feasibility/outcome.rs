//! Consistent standard parameters, their sources and their costs.

use serde::Serialize;

use super::body::Body;
use super::judgement::{Judgement, Shift};
use super::prior::PriorSource;

/// Source of the value of a standard parameter, judged from the regrouping only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueSource {
    /// Data: the parameter is a base parameter by itself, identified or fixed.
    Data,
    /// Prior, and data through the body that the parameter belongs to. No torque depends on it.
    Prior,
    /// Only a sum with other parameters is known. The prior decides how it is split.
    Combination,
    /// None: the identified model does not have the parameter, and it is 0.
    Absent,
}

/// Standard parameter of the outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardParameter {
    /// Its name.
    pub name: String,
    /// Value \[SI\]. It is that of the prior or close to it if the class is [`ValueSource::Prior`].
    pub value: f64,
    /// √Var(θ; H⁻¹): posterior standard deviation from data and prior together.
    pub deviation: f64,
    /// Source of the value. Report it together with the value: without prior, masses are barely
    /// bounded.
    pub class: ValueSource,
    /// Reduction of the prior's variance by the data, 0 to 1. High shares with the class
    /// [`ValueSource::Prior`] come from the prior's body.
    pub share_of_data: f64,
}

/// Minimum of J + λ (Σ D + Σ d).
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// All standard parameters in the order of the regressor's columns.
    pub parameters: Vec<StandardParameter>,
    /// The body of each link.
    pub link_bodies: Vec<Body>,
    /// Smallest eigenvalue of each link's pseudo-inertia relative to that of the prior; positive.
    pub smallest_eigenvalues: Vec<f64>,
    /// Source of the prior.
    pub prior: PriorSource,
    /// λ.
    pub weight: f64,
    /// F = J + λ (Σ D + Σ d).
    pub objective: f64,
    /// J, the squared distance from the estimate in its standard deviations.
    pub cost: f64,
    /// J with a negligible prior (λ = 0.03), about one above the least cost of any bodies. A larger
    /// λ applies if J already shows there that no bodies within 300 nats of the prior explain the
    /// estimate.
    pub least_cost: f64,
    /// χ² at 99 %. The cost of the true bodies stays below it.
    pub threshold: f64,
    /// D of each link, its distance from the prior \[nats\].
    pub divergence_per_link: Vec<f64>,
    /// Σ d of friction and drive inertias \[nats\].
    pub divergence_of_drives: f64,
    /// Number of base parameters that the data decide.
    pub effective_parameters: f64,
    /// Shift of each row from the estimate to the bodies: identified base parameters first, then
    /// fixed ones.
    pub shifts: Vec<Shift>,
    /// Friction and drive inertias that are more than 3 σ below 0 in the estimate. If the estimate
    /// is infeasible, report them first.
    pub negative_parameters: Vec<Shift>,
    /// Judgement on whether bodies explain the estimate.
    pub judgement: Judgement,
    /// Newton steps.
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
