//! Whether residuals are white noise, but for the colour that the filter gave them.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Ljung and Box's test of the residuals of one joint (*Biometrika* 65, 1978).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LjungBox {
    /// `n (n + 2) Σ_l r_l²/(n − l)` over the lags, of χ² distribution with as many degrees of freedom.
    pub statistic: f64,
    /// Lags that were summed; none in a record too short to tell.
    pub lags: usize,
}

impl LjungBox {
    /// Of autocorrelations r_1, r_2, … of n independent samples.
    pub(super) fn of(autocorrelations: &[f64], n: f64) -> Self {
        let lags = (1..).zip(autocorrelations);
        let terms = lags.map(|(lag, r): (u16, _)| r * r / (n - f64::from(lag)));
        let statistic = n * (n + 2.0) * terms.sum::<f64>();
        Self { statistic, lags: autocorrelations.len() }
    }

    /// How often white noise is at least as correlated as this.
    pub fn probability(&self) -> f64 {
        ChiSquared::new(self.lags as f64).map_or(1.0, |chi_squared| chi_squared.sf(self.statistic))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::super::{Observations, ResidualSpectrum, RowFilter};

    /// Without a filter and without parameters it is the textbook's, here statsmodels'
    /// (`core/tests/golden/ljung_box.py`).
    #[test]
    fn without_a_filter_it_is_that_of_statsmodels() {
        let golden: toml::Table =
            toml::from_str(include_str!("../../tests/golden/ljung_box.toml")).unwrap();
        let lags = golden["lags"].as_integer().unwrap();
        for name in ["white", "coloured"] {
            let number = |key: &str| golden[name][key].as_float().unwrap();
            let values = golden[name]["residuals"].as_array().unwrap();
            let residuals =
                DVector::from_iterator(values.len(), values.iter().map(|v| v.as_float().unwrap()));
            let column = DMatrix::from_element(residuals.len(), 1, 1.0);
            let system = Observations::new(column, residuals.clone(), 1).unwrap();
            let filter = RowFilter::new(residuals.len(), 1.0, |_| 1.0);
            let none = filter.no_leverage(1);
            let spectrum = ResidualSpectrum::fit(&system, &none, &residuals, &filter);
            let found = spectrum.ljung_box_per_joint()[0];
            assert_eq!(i64::try_from(found.lags).unwrap(), lags);
            let relative = |found: f64, expected: f64| (found / expected - 1.0).abs();
            // Rounding of a transform of 512 values, and of an incomplete gamma function.
            assert!(relative(found.statistic, number("statistic")) < 1e-11, "{found:?}");
            assert!(relative(found.probability(), number("probability")) < 1e-9, "{found:?}");
        }
    }
}
