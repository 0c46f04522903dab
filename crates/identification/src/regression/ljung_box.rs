//! Test for white noise in residuals, without the colour that is due to the filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::stored_value::number;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Ljung and Box's test of the residuals of one joint (*Biometrika* 65, 1978).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LjungBox {
    /// `n (n + 2) Σ_l r_l²/(n − l)` over the lags. It has a χ² distribution with as many degrees of
    /// freedom as lags.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub statistic: f64,
    /// Number of summed lags; 0 if the record is too short.
    #[serde(rename = "lags")]
    pub lag_count: usize,
}

impl LjungBox {
    /// Creates the test from autocorrelations r_1, r_2, … of n independent samples.
    pub(super) fn from_autocorrelations(autocorrelations: &[f64], n: f64) -> Self {
        let lag_number = (1..).zip(autocorrelations);
        let terms = lag_number.map(|(lag, r): (u16, _)| r * r / (n - f64::from(lag)));
        let statistic = n * (n + 2.0) * terms.sum::<f64>();
        Self { statistic, lag_count: autocorrelations.len() }
    }

    /// Returns the probability that white noise is at least as correlated as the residuals.
    pub fn probability(&self) -> f64 {
        ChiSquared::new(self.lag_count as f64)
            .map_or(1.0, |chi_squared| chi_squared.sf(self.statistic))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::super::{Observations, ResidualSpectrum, RowFilter};

    /// Without a filter and without parameters the test is the textbook's, here that of statsmodels
    /// (`crates/identification/tests/golden/ljung_box.py`).
    #[test]
    fn without_a_filter_it_is_that_of_statsmodels() {
        let golden: toml::Table =
            toml::from_str(include_str!("../../tests/golden/ljung_box.toml")).unwrap();
        let lag_count = golden["lags"].as_integer().unwrap();
        for name in ["white", "coloured"] {
            let number = |key: &str| golden[name][key].as_float().unwrap();
            let values = golden[name]["residuals"].as_array().unwrap();
            let residuals =
                DVector::from_iterator(values.len(), values.iter().map(|v| v.as_float().unwrap()));
            let column = DMatrix::from_element(residuals.len(), 1, 1.0);
            let system = Observations::new(column, residuals.clone(), 1).unwrap();
            let filter = RowFilter::new(residuals.len(), 1.0, |_| 1.0);
            let none = filter.zero_leverage(1);
            let spectrum = ResidualSpectrum::fit(&system, &none, &residuals, &filter, 1.0);
            let test = spectrum.ljung_box_per_joint()[0];
            assert_eq!(i64::try_from(test.lag_count).unwrap(), lag_count);
            let relative = |found: f64, expected: f64| (found / expected - 1.0).abs();
            // Rounding of a transform of 512 values, and of an incomplete gamma function.
            assert!(relative(test.statistic, number("statistic")) < 1e-11, "{test:?}");
            assert!(relative(test.probability(), number("probability")) < 1e-9, "{test:?}");
        }
    }
}
