//! Autocorrelation of residuals and of filtered white noise.

use super::row_filter::RowFilter;

/// Expected autocorrelation at one lag of white noise after the decimation filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseAutocorrelation {
    /// Mean: the autocorrelation due to the filter.
    pub mean: f64,
    /// Standard deviation over records of this length; 1/√N for N rows without a filter.
    pub deviation: f64,
}

/// Returns `r_l = Σ_k ρ_k ρ_{k−l} / Σ_k ρ_k²` for l from 1 to `lag_count`; empty if all residuals
/// are 0.
///
/// The mean is not removed, because the residuals of a correct model have mean zero.
pub fn autocorrelation(residuals: &[f64], lag_count: usize) -> Vec<f64> {
    let product = |lag: usize| -> f64 {
        residuals.iter().zip(residuals.iter().skip(lag)).map(|(a, b)| a * b).sum()
    };
    let power = product(0);
    if power > 0.0 { (1..=lag_count).map(|lag| product(lag) / power).collect() } else { Vec::new() }
}

impl RowFilter {
    /// Returns the autocorrelation of filtered white noise for a record of this number of rows. The
    /// lags are 1 to `lag_count`, fewer in a short record. The mean is the Fourier transform of the
    /// power spectrum. Bartlett's formula (*J. R. Statist. Soc.* Suppl. 8, 1946) gives the variance
    /// for long records with the mean ρ:
    ///
    /// ```text
    /// 1/N Σ_{i≥1} (ρ_{i+l} + ρ_{i−l} − 2 ρ_l ρ_i)²
    /// ```
    pub fn autocorrelation_of_white_noise(
        &self,
        rows: usize,
        lag_count: usize,
    ) -> Vec<NoiseAutocorrelation> {
        // Transform of the two-sided spectrum, which is even. The lags go from 0 to the number of
        // rows, which is practically infinite.
        let length = self.fourier.length();
        let both: Vec<f64> = (0..length).map(|k| self.power[k.min(length - k)]).collect();
        let transform = self.fourier.transform(&[&both]);
        let rho: Vec<f64> =
            transform.iter().map(|lag| lag.re.0[0] / transform[0].re.0[0]).collect();
        let lag_number = lag_count.min(rows.saturating_sub(1));
        let variance = |lag: usize| {
            let terms = (1..rho.len().saturating_sub(lag))
                .map(|i| rho[i + lag] + rho[i.abs_diff(lag)] - 2.0 * rho[lag] * rho[i]);
            terms.map(|term| term * term).sum::<f64>() / rows as f64
        };
        let autocorrelation =
            |lag| NoiseAutocorrelation { mean: rho[lag], deviation: variance(lag).sqrt() };
        (1..=lag_number).map(autocorrelation).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A moving average of order 1, x_k = e_k + θ e_{k−1}, has |H|² = 1 + θ² + 2 θ cos ω and
    /// ρ_1 = θ/(1 + θ²); Box and Jenkins, *Time Series Analysis*, 2.1.6, give the variances.
    #[test]
    fn a_moving_average_has_its_textbook_variances() {
        let (theta, rows) = (0.6, 400);
        let power =
            |ratio: f64| 1.0 + theta * theta + 2.0 * theta * (core::f64::consts::PI * ratio).cos();
        let expected = RowFilter::new(rows, 1.0, power).autocorrelation_of_white_noise(rows, 5);
        let rho = theta / (1.0 + theta * theta);
        let first = 1.0 - 3.0 * rho.powi(2) + 4.0 * rho.powi(4);
        let later = 1.0 + 2.0 * rho.powi(2);
        for (k, found) in expected.iter().enumerate() {
            let (mean, variance) = if k == 0 { (rho, first) } else { (0.0, later) };
            // Rounding of a transform of 1024 values.
            assert!((found.mean - mean).abs() < 1e-13, "{k}: {found:?}");
            assert!((found.deviation.powi(2) * 400.0 - variance).abs() < 1e-12, "{k}: {found:?}");
        }
        assert_eq!(expected.len(), 5);
    }

    #[test]
    fn it_agrees_with_the_durbin_watson_statistic() {
        let filter = RowFilter::new(300, 0.8, |ratio| if ratio <= 0.8 { 1.0 } else { 0.01 });
        let first = filter.autocorrelation_of_white_noise(300, 1)[0];
        assert!((2.0 * (1.0 - first.mean) - filter.durbin_watson_of_white_noise()).abs() < 1e-13);
        assert_eq!(filter.autocorrelation_of_white_noise(3, 30).len(), 2);
    }

    #[test]
    fn of_residuals() {
        assert_eq!(autocorrelation(&[1.0, -1.0, 1.0, -1.0], 2), [-0.75, 0.5]);
        assert_eq!(autocorrelation(&[2.0, 0.0], 3), [0.0, 0.0, 0.0]);
        assert!(autocorrelation(&[0.0; 4], 2).is_empty() && autocorrelation(&[], 2).is_empty());
    }
}
