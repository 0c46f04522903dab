//! Whether a load is there, and whether it is the one that somebody declares.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::equation::LoadSums;
use super::error::PayloadError;
use super::load::Uncertain;

/// How seldom a load is called wrong or there that is not: that of 3 standard deviations.
const SELDOM: f64 = 0.0027;
/// Of the masses that agree with what is found, the part below the limit.
const BELOW_LIMIT: f64 = 0.95;
/// Of χ², which the cost of the true body stays below in this part of all records.
const BODIES: f64 = 0.99;

/// What somebody declares of the load: compared with what is found, and where that tells nothing, where bodies are looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Declared {
    /// Mass \[kg\].
    pub mass_kg: Option<f64>,
    /// Centre of mass in the frame of the last link \[m\].
    pub centre_m: Option<[f64; 3]>,
}

/// A distance of several values from others, by their covariance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distance {
    /// χ².
    pub chi_squared: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// How probable so large a χ² is by chance.
    pub probability: f64,
}

impl Distance {
    pub(crate) fn of(
        values: &DVector<f64>,
        covariance: DMatrix<f64>,
    ) -> Result<Self, PayloadError> {
        let factor = covariance.cholesky().ok_or(PayloadError::Covariance)?;
        let (chi_squared, degrees_of_freedom) = (values.dot(&factor.solve(values)), values.len());
        let distribution = ChiSquared::new(degrees_of_freedom as f64);
        let probability = distribution.map_or(1.0, |of| of.sf(chi_squared));
        Ok(Self { chi_squared, degrees_of_freedom, probability })
    }

    /// Whether it is not by chance.
    pub fn is_significant(&self) -> bool {
        self.probability < SELDOM
    }
}

/// Whether a load is there at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Presence {
    /// Whether it is: its mass is more than 3 standard deviations, or where the mass is not told, the torques are not those of the
    /// arm alone.
    pub seen: bool,
    /// Mass over its standard deviation; none where the mass is not told.
    pub mass_deviations: Option<f64>,
    /// Where a mass is not seen, what it is below of with a probability of 95 %, no mass being negative \[kg\]; none where what is found is so
    /// negative that no mass agrees with it.
    pub mass_limit_kg: Option<f64>,
    /// All that is told of the load from nothing.
    pub from_none: Distance,
}

impl Presence {
    pub(super) fn of(
        mass_kg: Option<Uncertain>,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Result<Self, PayloadError> {
        let from_none = Distance::of(values, covariance.clone())?;
        let seen = mass_kg.map_or(from_none.is_significant(), |mass| mass.is_seen());
        Ok(Self {
            seen,
            mass_deviations: mass_kg.map(|mass| mass.deviations_from(0.0)),
            mass_limit_kg: mass_kg.filter(|of| !of.differs_from_none()).map(limit),
            from_none,
        })
    }
}

/// The quantile of a normal variable that is known not to be negative.
fn limit(mass: Uncertain) -> f64 {
    let normal = Normal::standard();
    // Above the limit is so much of what is above 0.
    let above = (1.0 - BELOW_LIMIT) * normal.sf(-mass.deviations_from(0.0));
    mass.value - mass.standard_deviation * normal.inverse_cdf(above)
}

/// What is found against what is declared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// How far the mass is above the declared one, in its standard deviations; none where it is not told or not declared.
    pub mass_deviations: Option<f64>,
    /// The same of the first moments, which the declared centre has for the mass that is found: so it can be said where no mass is
    /// seen.
    pub centre_deviations: [Option<f64>; 3],
    /// All of it together.
    pub together: Distance,
    /// Whether the declared load lies within the uncertainty: such a distance is not rarer by chance than one of 3 σ.
    pub within: bool,
}

impl Comparison {
    /// None where nothing is declared that is told.
    pub(super) fn of(
        declared: Declared,
        sums: &LoadSums,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Result<Option<Self>, PayloadError> {
        const MASS: usize = 9;
        const FIRST_MOMENT: usize = 6;

        let mass = sums.alone(MASS);
        // Sums with their weights, and what these come to.
        let of_mass = declared.mass_kg.zip(mass).map(|(kg, m)| (vec![(m, 1.0)], kg));
        let of_centre = [0, 1, 2].map(|k| {
            let (centre, m) = (declared.centre_m?, mass?);
            Some((vec![(sums.alone(FIRST_MOMENT + k)?, 1.0), (m, -centre[k])], 0.0))
        });
        let rows: Vec<_> = core::iter::once(&of_mass).chain(&of_centre).flatten().collect();
        if rows.is_empty() {
            return Ok(None);
        }
        let mut weights = DMatrix::zeros(rows.len(), values.len());
        for (row, (terms, _)) in rows.iter().enumerate() {
            terms.iter().for_each(|(sum, weight)| weights[(row, *sum)] += weight);
        }
        let stated = DVector::from_iterator(rows.len(), rows.iter().map(|(_, stated)| *stated));
        let off = &weights * values - stated;
        let covariance = &weights * covariance * weights.transpose();
        let mut deviations = (0..off.len()).map(|row| off[row] / covariance[(row, row)].sqrt());
        let mass_deviations = of_mass.as_ref().and_then(|_| deviations.next());
        let centre_deviations = of_centre.each_ref().map(|of| {
            of.as_ref()?;
            deviations.next()
        });
        let together = Distance::of(&off, covariance.clone())?;
        let within = !together.is_significant();
        Ok(Some(Self { mass_deviations, centre_deviations, together, within }))
    }
}

/// What the cost of the true body stays below, where so many sums are told.
pub(super) fn cost_limit(sums: usize) -> f64 {
    ChiSquared::new(sums as f64).map_or(f64::INFINITY, |of| of.inverse_cdf(BODIES))
}
