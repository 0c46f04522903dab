//! Judgement on whether bodies explain the estimate.

use core::fmt;

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::estimate::Rows;
use didim_dynamics::robot::{Parameter, ParameterKind};

/// Share of all estimates in which the cost of the true bodies stays below the limit of χ².
const PROBABILITY: f64 = 0.99;
/// Limit in standard deviations. Friction or a drive inertia that is farther below 0 is reported as
/// negative. An estimate counts as stretched if a base parameter is moved farther.
const DEVIATIONS: f64 = 3.0;
/// Distance of the bodies from the prior beyond which the data contradict it, all together and a
/// single one \[nats\].
const FAR_TOGETHER: f64 = 30.0;
const FAR_ALONE: f64 = 8.0;

/// A base parameter, and a distance in its own standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct Shift {
    /// Its name.
    pub name: String,
    /// Signed distance \[σ\].
    pub deviations: f64,
}

/// Judgement on whether bodies explain the estimate. Reversed signs and delays show in the cost. If
/// gravity or an axis is reversed on both sides, the cost stays low, but the bodies are far from
/// the prior. Neither reveals wrong friction laws, gains or lengths. Residuals and held-out samples
/// do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// Bodies explain it, and the nearest ones move none of its values by more than 3 σ.
    Feasible,
    /// Bodies explain it within its covariance, but even the nearest ones move some value by more
    /// than 3 σ.
    Stretched,
    /// No bodies explain it: their least cost exceeds 99 % of χ², which the cost of the true bodies
    /// does not.
    Infeasible,
    /// The bodies that explain it are far from the prior: a single one by more than 8 nats, or all
    /// together by more than 30.
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
    /// Judges by the least cost and shifts of bodies with a negligible prior, and by the
    /// divergences of the outcome's bodies.
    pub(super) fn new(
        least_cost: f64,
        threshold: f64,
        least_shifts: &[Shift],
        divergences: &[f64],
    ) -> Self {
        let together: f64 = divergences.iter().sum();
        if least_cost > threshold {
            Self::Infeasible
        } else if together > FAR_TOGETHER || divergences.iter().any(|own| *own > FAR_ALONE) {
            Self::ContradictsPrior
        } else if least_shifts.iter().any(|own| own.deviations.abs() > DEVIATIONS) {
            Self::Stretched
        } else {
            Self::Feasible
        }
    }
}

/// Returns χ² at 99 % with one degree of freedom per base parameter.
pub(super) fn threshold(parameters: usize) -> f64 {
    ChiSquared::new(parameters as f64).map_or(f64::INFINITY, |chi| chi.inverse_cdf(PROBABILITY))
}

/// Returns the parameters that are negative by more than 3 σ although they cannot be, with their
/// distance from 0.
pub(super) fn negative(rows: &Rows, parameters: &[Parameter]) -> Vec<Shift> {
    use ParameterKind::{Fc, FcMotor, Fv, Ia};

    let mut nonphysical = Vec::new();
    for (column, parameter) in parameters.iter().enumerate() {
        let Some(row) = rows.row_of(column).filter(|row| rows.is_alone(*row)) else { continue };
        let deviations = rows.values[row] / rows.deviation(row);
        if matches!(parameter.kind, Ia | Fv | Fc | FcMotor) && deviations < -DEVIATIONS {
            nonphysical.push(Shift { name: rows.names[row].clone(), deviations });
        }
    }
    nonphysical
}
