//! The difference between a parameter and its baseline value.

use super::DriftOptions;
use crate::archive::store::{HistoryLine, ParameterValue};

/// Difference between a parameter and its baseline value.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Its name.
    pub parameter: String,
    /// θ₀: the baseline value, in SI units.
    pub baseline: f64,
    /// Δ = θ − θ₀.
    pub difference: f64,
    /// σ_Δ = √(σ² + σ₀² + m²). The noise of two windows is independent. m is the contribution of
    /// model errors to the difference, which is negligible if both motions are similar.
    pub standard_deviation: f64,
    /// Half of the band: the larger of the two limits of [`DriftOptions`].
    pub half_band: f64,
}

impl Change {
    /// Returns the changes from a first result to a later one, in the order of the first. Contains
    /// the parameters that both results have.
    pub fn between_results(
        first: &HistoryLine,
        second: &HistoryLine,
        options: &DriftOptions,
    ) -> Vec<Self> {
        first
            .parameters
            .iter()
            .filter_map(|then: &ParameterValue| {
                let index = second.parameters.iter().position(|now| now.name == then.name)?;
                let by_model = second.deviation_by_model(index, first);
                Some(Self::new(then, &second.parameters[index], by_model, options))
            })
            .collect()
    }

    /// Creates the change from the baseline value to a later one. `by_model` is the model error m,
    /// in the unit of the two values.
    pub(super) fn new(
        then: &ParameterValue,
        now: &ParameterValue,
        by_model: f64,
        options: &DriftOptions,
    ) -> Self {
        let standard_deviation =
            now.standard_deviation.hypot(then.standard_deviation).hypot(by_model);
        let (noise, matters) =
            (options.standard_deviations * standard_deviation, options.relative * then.value.abs());
        Self {
            parameter: now.name.clone(),
            baseline: then.value,
            difference: now.value - then.value,
            standard_deviation,
            // Without a finite standard deviation, no judgement is possible. `max` would ignore a
            // NaN, and every value would be inside an infinite band.
            half_band: if noise.is_finite() { noise.max(matters) } else { f64::NAN },
        }
    }

    /// Returns Δ / σ_Δ.
    pub fn difference_deviations(&self) -> f64 {
        self.difference / self.standard_deviation
    }

    /// Returns θ/θ₀ − 1. It is positive if the magnitude of the parameter has grown, for positive
    /// and negative parameters.
    pub fn relative_change(&self) -> f64 {
        // Adding 0.0 turns a negative zero into a positive one.
        self.difference / self.baseline + 0.0
    }

    /// Returns the standard deviation of [`Self::relative_change`], to first order.
    pub fn relative_deviation(&self) -> f64 {
        self.standard_deviation / self.baseline.abs()
    }

    /// Returns |Δ| relative to half of the band. A value above 1 is outside the band.
    pub fn band_share(&self) -> f64 {
        self.difference.abs() / self.half_band
    }
}
