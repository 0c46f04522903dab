//! The difference between a parameter and that of the baseline.

use super::DriftOptions;
use crate::archive::store::{HistoryLine, ParameterValue};

/// How a parameter differs from its baseline.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Its name.
    pub parameter: String,
    /// θ₀: the baseline's value, in SI units.
    pub baseline: f64,
    /// Δ = θ − θ₀.
    pub difference: f64,
    /// σ_Δ = √(σ² + σ₀² + m²): two windows have no noise in common. m is what errors of the model make of the difference:
    /// next to nothing where both motions are alike.
    pub standard_deviation: f64,
    /// Half of the band: the larger of both limits of [`DriftOptions`].
    pub half_band: f64,
}

impl Change {
    /// From one result to a later one: of every parameter that both have, in the order of the first.
    pub fn all(first: &HistoryLine, second: &HistoryLine, options: &DriftOptions) -> Vec<Self> {
        let of = |then: &ParameterValue| {
            let index = second.parameters.iter().position(|now| now.name == then.name)?;
            let by_model = second.deviation_by_model(index, first);
            Some(Self::new(then, &second.parameters[index], by_model, options))
        };
        first.parameters.iter().filter_map(of).collect()
    }

    /// From the baseline's value to a later one; `by_model` is m, in the unit of both.
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
            // Without a finite standard deviation nothing can be said: a maximum would pass over
            // what is no number, and within an infinite band everything is well.
            half_band: if noise.is_finite() { noise.max(matters) } else { f64::NAN },
        }
    }

    /// Δ / σ_Δ.
    pub fn deviations(&self) -> f64 {
        self.difference / self.standard_deviation
    }

    /// θ/θ₀ − 1: positive where the parameter has grown, whatever its sign.
    pub fn relative(&self) -> f64 {
        // No negative zero.
        self.difference / self.baseline + 0.0
    }

    /// Standard deviation of [`Self::relative`], to the first order.
    pub fn relative_deviation(&self) -> f64 {
        self.standard_deviation / self.baseline.abs()
    }

    /// |Δ| as a share of half of the band: more than 1 is outside.
    pub fn band_share(&self) -> f64 {
        self.difference.abs() / self.half_band
    }
}
