//! Judgement whether bodies explain the estimate.

use core::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::estimate::Rows;
use didim_dynamics::robot::{Parameter, ParameterKind};

/// Limits of the judgement.
#[derive(Clone, Debug, PartialEq)]
pub struct FeasibilityLimits {
    /// Share of all estimates in which the cost of the true bodies stays below the χ² limit \[1\].
    /// Convention: 99 %.
    pub probability: f64,
    /// Distance \[σ\] below 0 beyond which friction or a drive inertia is reported as negative. It
    /// is also the largest shift of a base parameter to the nearest bodies in a
    /// [`Judgement::Feasible`] estimate. Convention: 3 standard deviations.
    pub deviations: f64,
    /// Distance of all bodies together from the prior beyond which the data contradict the prior,
    /// λ Σ D: a sum of squares in standard deviations of the prior \[1\]. Convention.
    pub prior_distance: f64,
    /// The same for a single body. Convention.
    pub prior_distance_per_link: f64,
}

impl Default for FeasibilityLimits {
    fn default() -> Self {
        Self {
            probability: 0.99,
            deviations: 3.0,
            prior_distance: 60.0,
            prior_distance_per_link: 16.0,
        }
    }
}

/// Base parameter with a distance in its own standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct Shift {
    /// Name of the base parameter.
    pub name: String,
    /// Signed distance \[σ\].
    pub deviations: f64,
}

/// Judgement whether bodies explain the estimate. Reversed signs and delays increase the cost. If
/// gravity or an axis is reversed in both model and data, the cost stays low, but the bodies are
/// far from the prior. Wrong friction laws, gains or lengths change neither cost nor distance;
/// residuals and held-out samples reveal them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// Bodies explain the estimate, and the nearest ones shift none of its values by more than 3 σ.
    Feasible,
    /// Bodies explain the estimate within its covariance, but even the nearest ones shift some
    /// value by more than 3 σ.
    Stretched,
    /// No bodies explain the estimate: their smallest cost exceeds the 99 % limit of χ², which the
    /// cost of the true bodies does not.
    Infeasible,
    /// The bodies that explain the estimate are far from the prior, by more than its standard
    /// deviation allows.
    ContradictsPrior,
}

impl fmt::Display for Judgement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Feasible => "bodies explain the estimate",
            Self::Stretched => {
                "physically consistent parameters exist, but some change by more than 3 σ"
            }
            Self::Infeasible => "no physically consistent parameters explain the estimate",
            Self::ContradictsPrior => {
                "the consistent parameters that explain the estimate \
                contradict the prior"
            }
        })
    }
}

impl Judgement {
    /// Creates the judgement from the smallest cost and shifts of bodies with a negligible prior,
    /// and from the distances of the outcome's bodies from the prior, λ D.
    pub(super) fn new(
        (least_cost, threshold): (f64, f64),
        least_shifts: &[Shift],
        prior_distances: &[f64],
        limits: &FeasibilityLimits,
    ) -> Self {
        let is_far = |own: &f64| *own > limits.prior_distance_per_link;
        let together: f64 = prior_distances.iter().sum();
        if least_cost > threshold {
            Self::Infeasible
        } else if together > limits.prior_distance || prior_distances.iter().any(is_far) {
            Self::ContradictsPrior
        } else if least_shifts.iter().any(|own| own.deviations.abs() > limits.deviations) {
            Self::Stretched
        } else {
            Self::Feasible
        }
    }
}

/// Returns χ² at the configured probability with one degree of freedom per base parameter.
pub(super) fn threshold(parameters: usize, limits: &FeasibilityLimits) -> f64 {
    let distribution = ChiSquared::new(parameters as f64);
    distribution.map_or(f64::INFINITY, |chi| chi.inverse_cdf(limits.probability))
}

/// Returns the parameters that are negative by more than the limit although they cannot be
/// negative, with their distance from 0.
pub(super) fn negative_parameters(
    rows: &Rows,
    parameters: &[Parameter],
    limits: &FeasibilityLimits,
) -> Vec<Shift> {
    use ParameterKind::{Fc, FcMotor, Fv, Ia};

    let mut nonphysical = Vec::new();
    for (column, parameter) in parameters.iter().enumerate() {
        let Some(row) = rows.row_of(column).filter(|row| rows.is_alone(*row)) else { continue };
        let deviations = rows.values[row] / rows.deviation(row);
        if matches!(parameter.kind, Ia | Fv | Fc | FcMotor) && deviations < -limits.deviations {
            nonphysical.push(Shift { name: rows.names[row].clone(), deviations });
        }
    }
    nonphysical
}
