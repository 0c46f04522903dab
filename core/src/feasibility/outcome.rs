//! Consistent standard parameters, where each comes from, and what they cost.

use serde::Serialize;

use super::body::Body;
use super::judgement::{Judgement, Shift};
use super::prior::PriorSource;

/// What decides a standard parameter, by the regrouping alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// The data: it is a base parameter of its own, identified or held.
    Data,
    /// The prior, and the data through the body that it belongs to: no torque depends on it.
    Prior,
    /// Only a sum with others is known; how it is split is the prior's.
    Combination,
    /// Nothing: the identified model does not have it, and it is 0.
    Absent,
}

/// One standard parameter of the outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardParameter {
    /// Its name.
    pub name: String,
    /// Its value \[SI\], that of the prior or near it where the class is [`Class::Prior`].
    pub value: f64,
    /// √Var(θ; H⁻¹): what the data and the prior together leave open.
    pub deviation: f64,
    /// What decides it. Say it wherever the value is said: without prior, masses are hardly bounded.
    pub class: Class,
    /// By how much the data lower the prior's variance, 0 to 1. High shares of the class [`Class::Prior`] come from
    /// the prior's body.
    pub share_of_data: f64,
}

/// The minimum of J + λ (Σ D + Σ d).
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// All standard parameters in the order of the regressor's columns.
    pub parameters: Vec<StandardParameter>,
    /// The body of each link.
    pub bodies: Vec<Body>,
    /// Of each link, the smallest eigenvalue of its pseudo-inertia beside the prior's; positive.
    pub smallest_eigenvalues: Vec<f64>,
    /// Where the prior comes from.
    pub prior: PriorSource,
    /// λ.
    pub weight: f64,
    /// F = J + λ (Σ D + Σ d).
    pub objective: f64,
    /// J, the squared distance from the estimate in its standard deviations.
    pub cost: f64,
    /// J where the prior hardly counts (λ = 0.03), about one above the least that bodies cost; or at the larger λ where
    /// it shows already that no bodies within 300 nats of the prior explain the estimate.
    pub least_cost: f64,
    /// χ² at 99 %, which the cost of the true bodies stays below.
    pub threshold: f64,
    /// D of each link, its distance from the prior \[nats\].
    pub divergence_per_link: Vec<f64>,
    /// Σ d of friction and drive inertias \[nats\].
    pub divergence_of_drives: f64,
    /// How many base parameters the data decide.
    pub effective_parameters: f64,
    /// Of each row, by how much the bodies move it from the estimate: identified base parameters first, then held ones.
    pub shifts: Vec<Shift>,
    /// Friction and drive inertias that the estimate has below 0 by more than 3 σ: the first thing to say where
    /// the estimate is infeasible.
    pub negative: Vec<Shift>,
    /// Whether bodies explain the estimate.
    pub judgement: Judgement,
    /// Newton steps.
    pub steps: usize,
}

impl Outcome {
    /// The base parameter that is moved farthest.
    pub fn largest_shift(&self) -> Option<&Shift> {
        self.shifts.iter().max_by(|a, b| a.deviations.abs().total_cmp(&b.deviations.abs()))
    }

    /// Values of all standard parameters, in the order of the regressor's columns.
    pub fn standard(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.value).collect()
    }
}
