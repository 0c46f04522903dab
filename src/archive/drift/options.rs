//! Drift options: `[service.drift]` of the cell file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Conditions under which a parameter has left its band, and the required duration.
///
/// A parameter θ has left the band of its baseline θ₀ when |θ − θ₀| is more than
/// `standard_deviations`·σ_Δ **and** more than `relative`·|θ₀|. The first condition shows that the
/// difference is real, the second that it matters. The standard deviation of a good window is some
/// 0.05 %. Friction changes by several per cent between a cold and a warm arm without any defect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriftOptions {
    /// Half of the band, in standard deviations of the difference \[σ\]; 1 to 100.
    pub standard_deviations: f64,
    /// Half of the band, as a share of the baseline's value \[share\]; 0 to 10.
    pub relative: f64,
    /// Results in a row outside the band that raise the alarm, and inside that clear it; 1 to 100.
    pub results: u32,
    /// Days with results of which the trend is formed, the last ones \[d\]; 3 to 500.
    pub trend_results: usize,
}

/// Maximum number of days in a trend. It covers more than a year.
const MAX_TREND_DAYS: usize = 500;

impl Default for DriftOptions {
    fn default() -> Self {
        Self { standard_deviations: 4.0, relative: 0.1, results: 2, trend_results: 50 }
    }
}

/// An option is outside its range. Change it in the cell file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct DriftOptionError {
    /// Key, with its path from the top of the cell file.
    pub key: &'static str,
    /// The problem, and the allowed values.
    pub problem: String,
}

impl DriftOptions {
    /// Checks every option.
    ///
    /// # Errors
    /// [`DriftOptionError`] names the first invalid option.
    pub fn validate(&self) -> Result<(), DriftOptionError> {
        let refuse = |key, problem: String| Err(DriftOptionError { key, problem });
        let Self { standard_deviations, relative, results, trend_results } = *self;
        if !(1.0..=100.0).contains(&standard_deviations) {
            let problem = format!("{standard_deviations} is not in 1..=100");
            return refuse("service.drift.standard_deviations", problem);
        }
        if !(0.0..=10.0).contains(&relative) {
            return refuse("service.drift.relative", format!("{relative} is not in 0..=10"));
        }
        if !(1..=100).contains(&results) {
            return refuse("service.drift.results", format!("{results} is not in 1..=100"));
        }
        if !(3..=MAX_TREND_DAYS).contains(&trend_results) {
            let problem = format!("{trend_results} is not in 3..={MAX_TREND_DAYS}");
            return refuse("service.drift.trend_results", problem);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_meant_is_refused_by_its_key() {
        assert_eq!(DriftOptions::default().validate(), Ok(()));
        for (text, key) in [
            ("standard_deviations = 0.5", "service.drift.standard_deviations"),
            ("standard_deviations = nan", "service.drift.standard_deviations"),
            ("relative = -0.1", "service.drift.relative"),
            ("relative = 11.0", "service.drift.relative"),
            ("results = 0", "service.drift.results"),
            ("trend_results = 2", "service.drift.trend_results"),
            ("trend_results = 501", "service.drift.trend_results"),
        ] {
            let options: DriftOptions = toml::from_str(text).unwrap();
            assert_eq!(options.validate().unwrap_err().key, key, "{text}");
        }
        assert!(toml::from_str::<DriftOptions>("relativ = 0.1").is_err());
    }
}
