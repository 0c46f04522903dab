//! Whether bodies explain the estimate.

use core::fmt;

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::estimate::Rows;
use crate::robot::{Parameter, ParameterKind};

/// Of χ², which the cost of the true bodies stays below in this part of all estimates.
const PROBABILITY: f64 = 0.99;
/// How many standard deviations a negative friction or drive inertia is below 0 before it is called so, and a base
/// parameter is moved before the estimate counts as stretched.
const DEVIATIONS: f64 = 3.0;
/// The bodies' distance from the prior, all together and one \[nats\], beyond which the data contradict it.
const FAR_TOGETHER: f64 = 30.0;
const FAR_ALONE: f64 = 8.0;

/// A base parameter, and a distance in its own standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct Shift {
    /// Its name.
    pub name: String,
    /// The distance, with its sign \[σ\].
    pub deviations: f64,
}

/// Whether bodies explain the estimate. The cost reveals reversed signs and delays; a gravity or an axis reversed on
/// both sides keeps it low and shows as bodies far from the prior. Neither reveals wrong friction laws, gains or
/// lengths: residuals and held-out samples do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// Bodies explain it, and the nearest ones move none of its values by more than 3 σ.
    Feasible,
    /// Bodies explain it within its covariance, but even the nearest ones move some value by more than 3 σ.
    Stretched,
    /// No bodies explain it: their least cost is beyond 99 % of χ², which the true ones' is not.
    Infeasible,
    /// Bodies explain it that are far from the prior: more than 8 nats one, or 30 all together.
    ContradictsPrior,
}

impl fmt::Display for Judgement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Feasible => "bodies explain the estimate",
            Self::Stretched => {
                "bodies explain the estimate, but have to move some of it by more than 3 σ"
            }
            Self::Infeasible => "no bodies explain the estimate",
            Self::ContradictsPrior => "the bodies that explain the estimate contradict the prior",
        })
    }
}

impl Judgement {
    /// By the least cost of bodies and their shifts where the prior hardly counts, and the distances of the outcome's.
    pub(super) fn of(
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

/// χ² of as many degrees of freedom as there are base parameters, at 99 %.
pub(super) fn threshold(parameters: usize) -> f64 {
    ChiSquared::new(parameters as f64).map_or(f64::INFINITY, |chi| chi.inverse_cdf(PROBABILITY))
}

/// What of the estimate is negative beyond 3 σ and cannot be, with its distance from 0.
pub(super) fn negative(rows: &Rows, parameters: &[Parameter]) -> Vec<Shift> {
    use ParameterKind::{Fc, FcMotor, Fv, Ia};

    let mut found = Vec::new();
    for (column, parameter) in parameters.iter().enumerate() {
        let Some(row) = rows.own(column).filter(|row| rows.is_alone(*row)) else { continue };
        let deviations = rows.values[row] / rows.deviation(row);
        if matches!(parameter.kind, Ia | Fv | Fc | FcMotor) && deviations < -DEVIATIONS {
            found.push(Shift { name: rows.names[row].clone(), deviations });
        }
    }
    found
}
