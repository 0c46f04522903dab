//! Presence of a load, and its agreement with the declared load.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::equation::LoadSums;
use super::error::PayloadError;
use super::load::UncertainValue;
use crate::identification::problem::PayloadLimits;

/// Declared values of the load, which are compared with the estimate. They also provide the start
/// of the search for a consistent body if the estimate lacks these values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeclaredLoad {
    /// Mass \[kg\].
    pub mass_kg: Option<f64>,
    /// Centre of mass in the frame of the last link \[m\].
    pub centre_m: Option<[f64; 3]>,
}

/// Squared distance of several values from reference values, in the metric of their covariance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MahalanobisDistance {
    /// Squared distance χ².
    pub chi_squared: f64,
    /// Degrees of freedom of χ².
    pub degrees_of_freedom: usize,
    /// Probability that χ² is at least this large by chance.
    pub probability: f64,
}

impl MahalanobisDistance {
    pub(crate) fn mass_presence(
        values: &DVector<f64>,
        covariance: DMatrix<f64>,
    ) -> Result<Self, PayloadError> {
        let factor = covariance.cholesky().ok_or(PayloadError::Covariance)?;
        let (chi_squared, degrees_of_freedom) = (values.dot(&factor.solve(values)), values.len());
        let distribution = ChiSquared::new(degrees_of_freedom as f64);
        let probability = distribution.map_or(1.0, |of| of.sf(chi_squared));
        Ok(Self { chi_squared, degrees_of_freedom, probability })
    }

    /// Returns true if the distance is too large to occur by chance.
    pub fn is_significant(&self, limits: &PayloadLimits) -> bool {
        self.probability < limits.chance_probability
    }
}

/// Presence of a load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Presence {
    /// True if a load is present: its mass exceeds 3 standard deviations. If the mass is
    /// unidentifiable, true if the torques differ significantly from those of the arm alone.
    pub seen: bool,
    /// Mass divided by its standard deviation; `None` if the mass is unidentifiable.
    pub mass_deviations: Option<f64>,
    /// Upper limit of an undetected mass \[kg\]: the mass is lower with a probability of 95 %,
    /// given that it is not negative. `None` if the estimate is so negative that it agrees with no
    /// mass.
    pub mass_limit_kg: Option<f64>,
    /// Distance of all identifiable load values from zero.
    pub from_none: MahalanobisDistance,
}

impl Presence {
    pub(super) fn from_limit(
        mass_kg: Option<UncertainValue>,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
        limits: &PayloadLimits,
    ) -> Result<Self, PayloadError> {
        let from_none = MahalanobisDistance::mass_presence(values, covariance.clone())?;
        let seen = match mass_kg {
            Some(mass) => mass.is_seen(limits),
            None => from_none.is_significant(limits),
        };
        Ok(Self {
            seen,
            mass_deviations: mass_kg.map(|mass| mass.deviations_from(0.0)),
            mass_limit_kg: mass_kg
                .filter(|of| !of.differs_from_none(limits))
                .map(|mass| mass_limit(mass, limits)),
            from_none,
        })
    }
}

/// Returns the upper limit of a mass that is known to be non-negative, at the probability
/// `mass_limit_probability`.
fn mass_limit(mass: UncertainValue, limits: &PayloadLimits) -> f64 {
    let normal = Normal::standard();
    // Probability of a mass above the limit: a share of the probability of a positive mass.
    let above = (1.0 - limits.mass_limit_probability) * normal.sf(-mass.deviations_from(0.0));
    mass.value - mass.standard_deviation * normal.inverse_cdf(above)
}

/// Comparison of the estimated and the declared load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Difference between the estimated and the declared mass, in standard deviations of the
    /// estimate; `None` if the mass is unidentifiable or not declared.
    pub mass_deviations: Option<f64>,
    /// Differences of the first moments, in standard deviations. The declared moments are computed
    /// from the declared centre and the estimated mass, so the comparison also works for an
    /// undetected mass.
    pub centre_deviations: [Option<f64>; 3],
    /// Distance of all compared values together.
    pub together: MahalanobisDistance,
    /// True if the declared load agrees with the estimate: a distance this large occurs by chance
    /// at least as often as one of 3 σ.
    pub within: bool,
}

impl Comparison {
    /// Returns `None` if no identifiable value is declared.
    pub(super) fn compare(
        declared: DeclaredLoad,
        sums: &LoadSums,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
        limits: &PayloadLimits,
    ) -> Result<Option<Self>, PayloadError> {
        const MASS_INDEX: usize = 9;
        const FIRST_MOMENT_INDICES: usize = 6;

        let mass = sums.separate_sum(MASS_INDEX);
        // Each comparison: sums with their weights, and the declared total.
        let of_mass = declared.mass_kg.zip(mass).map(|(kg, m)| (vec![(m, 1.0)], kg));
        let of_centre = [0, 1, 2].map(|k| {
            let (centre, m) = (declared.centre_m?, mass?);
            Some((vec![(sums.separate_sum(FIRST_MOMENT_INDICES + k)?, 1.0), (m, -centre[k])], 0.0))
        });
        let rows: Vec<_> = core::iter::once(&of_mass).chain(&of_centre).flatten().collect();
        if rows.is_empty() {
            return Ok(None);
        }
        let mut weights = DMatrix::zeros(rows.len(), values.len());
        for (row, (terms, _)) in rows.iter().enumerate() {
            terms.iter().for_each(|(sum, weight)| weights[(row, *sum)] += weight);
        }
        let declared_values =
            DVector::from_iterator(rows.len(), rows.iter().map(|(_, configured)| *configured));
        let off = &weights * values - declared_values;
        let covariance = &weights * covariance * weights.transpose();
        let mut deviations = (0..off.len()).map(|row| off[row] / covariance[(row, row)].sqrt());
        let mass_deviations = of_mass.as_ref().and_then(|_| deviations.next());
        let centre_deviations = of_centre.each_ref().map(|of| {
            of.as_ref()?;
            deviations.next()
        });
        let together = MahalanobisDistance::mass_presence(&off, covariance.clone())?;
        let within = !together.is_significant(limits);
        Ok(Some(Self { mass_deviations, centre_deviations, together, within }))
    }
}

/// Returns the limit below which the cost of the true body stays, for this number of identifiable
/// sums.
pub(super) fn cost_limit(sums: usize, limits: &PayloadLimits) -> f64 {
    let distribution = ChiSquared::new(sums as f64);
    distribution.map_or(f64::INFINITY, |of| of.inverse_cdf(limits.body_probability))
}
