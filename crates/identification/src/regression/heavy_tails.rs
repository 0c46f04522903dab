//! Prior with heavy tails of a configured value, in one dimension.

/// Estimate of a nuisance parameter by the data alone, in units of the tolerance of its configured
/// value.
///
/// The configured value is within its tolerance, or wrong by about ten tolerances, or anything.
/// A normal prior would believe a value that is grossly wrong.
pub(super) struct HeavyTails {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl HeavyTails {
    /// Scale \[tolerances\] and weight of each part of the prior. The weights 0.9, 0.09, 0.01 and
    /// 0.8, 0.15, 0.05 were compared with these. These have the smallest error in units of its
    /// uncertainty, 1.2, for torque gains that are wrong by factors of 1.03 to 3 and determined by
    /// the data to 6 %.
    const PARTS: [[f64; 2]; 3] = [[1.0, 0.5], [10.0, 0.4], [100.0, 0.1]];

    /// Returns the mean and the variance of the posterior. `colour` is the factor by which the
    /// noise increases the uncertainty of the data relative to white noise: it decides how much the
    /// data contradict the prior.
    ///
    /// Tails count in the proportion in which the data determine the parameter, because a value
    /// that no data can contradict rests on its tolerance.
    pub(super) fn posterior(&self, colour: f64) -> [f64; 2] {
        let coloured = self.variance * colour * colour;
        let certainty = 1.0 / (1.0 + coloured);
        let parts = Self::PARTS.map(|[scale, weight]| {
            let (prior, all) = (scale * scale, scale * scale + coloured);
            let weight = if scale > 1.0 { weight * certainty } else { weight };
            let log_weight = (weight / all.sqrt()).ln() - 0.5 * self.mean * self.mean / all;
            let share = prior / (prior + self.variance);
            (log_weight, share * self.mean, share * self.variance)
        });
        let largest = parts.iter().map(|part| part.0).fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
        for (log_weight, mean, variance) in parts {
            let weight = (log_weight - largest).exp();
            sum += weight;
            first += weight * mean;
            second += weight * (variance + mean * mean);
        }
        let mean = first / sum;
        [mean, second / sum - mean * mean]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns √E[η²] for this estimate by the data, in tolerances.
    fn size(mean: f64, deviation: f64) -> f64 {
        let data = HeavyTails { mean, variance: deviation * deviation };
        let [mean, variance] = data.posterior(1.0);
        mean.hypot(variance.sqrt())
    }

    #[test]
    fn a_larger_error_never_makes_a_value_more_certain() {
        for deviation in [0.1, 0.5, 1.0, 3.0, 6.0, 30.0] {
            let sizes: Vec<f64> =
                (0..400).map(|k| size(0.1 * 1.02_f64.powi(k), deviation)).collect();
            assert!(sizes.is_sorted(), "data of {deviation} tolerances");
        }
    }

    /// The data determine an error of a few of their standard deviations. Those of this test are at
    /// most six tolerances.
    #[test]
    fn an_error_that_the_data_determine_is_within_its_uncertainty() {
        for deviation in [0.1, 0.5, 1.0, 3.0, 6.0] {
            for k in 0..300 {
                let error = 3.2 * deviation * 1.02_f64.powi(k);
                let ratio = error / size(error, deviation);
                assert!(ratio < 2.5, "an error of {error}, data of {deviation}: {ratio}");
            }
        }
    }

    /// A normal prior would give 1/√(1 + 1/deviation²).
    #[test]
    fn a_right_value_keeps_its_tolerance() {
        for deviation in [0.1, 0.5, 1.0, 3.0, 6.0, 30.0, 1000.0] {
            let normal = 1.0 / 1.0_f64.hypot(1.0 / deviation);
            let ratio = size(0.0, deviation) / normal;
            assert!((1.0..1.2).contains(&ratio), "data of {deviation}: {ratio}");
        }
    }

    /// The posterior's moments are those of an integral over the prior's density.
    #[test]
    fn the_posterior_is_the_product_of_prior_and_likelihood() {
        let (of_data, deviation) = (12.0, 3.0);
        let normal = |x: f64, scale: f64| (-0.5 * (x / scale).powi(2)).exp() / scale;
        let certainty = 1.0 / (1.0 + deviation * deviation);
        let shares = [1.0, certainty, certainty];
        let moments = (-60_000..60_000).fold([0.0; 3], |[sum, first, second], k| {
            let x = 0.01 * f64::from(k);
            let parts = HeavyTails::PARTS.iter().zip(shares);
            let prior: f64 =
                parts.map(|([scale, weight], share)| weight * share * normal(x, *scale)).sum();
            let density = prior * normal(x - of_data, deviation);
            [sum + density, first + density * x, second + density * x * x]
        });
        let [sum, first, second] = moments;
        let expected = [first / sum, second / sum - (first / sum).powi(2)];
        let data = HeavyTails { mean: of_data, variance: deviation * deviation };
        let found = data.posterior(1.0);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} and {expected}");
        }
    }
}
