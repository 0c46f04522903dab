//! Improbability of a finding by chance.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

/// Improbability of a finding by chance, if it is the outcome of a statistical test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Significance {
    /// Probability that one test has such an outcome although nothing is wrong. An alternative
    /// reading has the odds against it, which Schwarz's criterion gives.
    pub probability: f64,
    /// Number of tests of this kind in the verdict.
    pub tests: usize,
}

impl Significance {
    /// Returns the significance of a deviation in either direction \[standard deviations\]. `None`
    /// if it is not a number.
    pub(super) fn of_deviation(deviations: f64, tests: usize) -> Option<Self> {
        let tail = Normal::standard().sf(deviations.abs());
        Self::of_probability(2.0 * tail, tests)
    }

    /// Returns the significance of a deviation below zero \[standard deviations\]. `None` if it is
    /// not a number.
    pub(super) fn of_deficit(deviations: f64, tests: usize) -> Option<Self> {
        Self::of_probability(Normal::standard().cdf(deviations), tests)
    }

    /// Returns the significance of odds against the configured reading, the number of tests
    /// counted \[nat\].
    pub(super) fn of_evidence(evidence: f64, tests: usize) -> Option<Self> {
        Self::of_probability((-evidence).exp() / tests as f64, tests)
    }

    /// Returns the significance of a probability. `None` if it is not a number.
    pub(super) fn of_probability(probability: f64, tests: usize) -> Option<Self> {
        probability.is_finite().then_some(Self { probability, tests })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_tests_is_counted_once() {
        let of_value = Significance::of_deviation(-1.96, 3).unwrap();
        assert!((of_value.probability - 0.05).abs() < 1e-4, "{of_value:?}");
        assert_eq!(of_value.tests, 3);
        let below = [-1.96, 1.96].map(|of| Significance::of_deficit(of, 3).unwrap().probability);
        assert!((below[0] - 0.025).abs() < 1e-4 && (below[1] - 0.975).abs() < 1e-4, "{below:?}");
        let of_reading = Significance::of_evidence(10.0, 40).unwrap();
        let all = of_reading.probability * of_reading.tests as f64;
        assert!((all.ln() + 10.0).abs() < 1e-12, "{of_reading:?}");
        assert_eq!(Significance::of_deviation(f64::NAN, 3), None);
        assert!(Significance::of_evidence(1e6, 3).unwrap().probability < f64::MIN_POSITIVE);
    }
}
