//! Drift in the status of the service.

use serde::{Deserialize, Serialize};

use super::{Change, Trend};
use crate::archive::store::Timestamp;

/// Differences between the parameters and the baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriftStatus {
    /// Number of the baseline's result.
    pub baseline: u64,
    /// Time of the baseline's identification.
    pub time: Timestamp,
    /// True if the last result was compared with the baseline.
    pub compared: bool,
    /// Reason why the last result was not compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// True if the configuration differs from the baseline's in a way that still allows a
    /// comparison.
    #[serde(default)]
    pub reconfigured: bool,
    /// Parameters of the last result, if it was compared.
    #[serde(default)]
    pub parameters: Vec<ParameterDrift>,
    /// Raised alarms.
    pub alarms: Vec<AlarmStatus>,
}

/// One parameter of the last result compared with the baseline. Values that are not numbers are
/// null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterDrift {
    /// Its name.
    pub parameter: String,
    /// Its quantity with the name of its joint or link. `None` if the robot has no names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Relative change θ/θ₀ − 1.
    pub relative_change: Option<f64>,
    /// Difference in standard deviations, Δ / σ_Δ.
    pub deviation_sigma: Option<f64>,
    /// |Δ| relative to half of the band. A value above 1 is outside the band.
    pub band_share: Option<f64>,
}

/// A raised alarm. Values that are not numbers are null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlarmStatus {
    /// The parameter.
    pub parameter: String,
    /// Its quantity with the name of its joint or link. `None` if the robot has no names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Relative change θ/θ₀ − 1.
    pub relative_change: Option<f64>,
    /// Difference in standard deviations, Δ / σ_Δ.
    pub deviation_sigma: Option<f64>,
    /// Slope of the trend, relative to θ₀ per day. `None` if there are results of fewer than three
    /// days.
    pub slope_per_day: Option<f64>,
    /// Standard deviation of the slope, in the same unit.
    pub slope_sd: Option<f64>,
    /// Time of the first result of the series that raised the alarm.
    pub since: Timestamp,
    /// The alarm as a sentence.
    pub text: String,
}

/// Maximum number of alarms that are listed as separate reasons. The others are counted.
const MAX_REASONS: usize = 5;

impl DriftStatus {
    /// Returns the reasons for bad health: one line per alarm up to the maximum number, and a line
    /// with the number of further alarms.
    pub fn reasons(&self) -> Vec<String> {
        let alarms = self.alarms.iter().take(MAX_REASONS).map(AlarmStatus::sentence);
        let more = self.alarms.len().saturating_sub(MAX_REASONS);
        let more = match more {
            0 => None,
            1 => Some("1 more parameter has left its band".to_owned()),
            _ => Some(format!("{more} more parameters have left their bands")),
        };
        alarms.chain(more).collect()
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl ParameterDrift {
    pub(super) fn from_change(change: &Change, description: Option<String>) -> Self {
        Self {
            parameter: change.parameter.clone(),
            description,
            relative_change: finite(change.relative_change()),
            deviation_sigma: finite(change.difference_deviations()),
            band_share: finite(change.band_share()),
        }
    }
}

impl AlarmStatus {
    /// Returns the alarm as a sentence, with the name of the joint or link if there is one.
    pub fn sentence(&self) -> String {
        match &self.description {
            Some(description) => format!("{description}: {}", self.text),
            None => self.text.clone(),
        }
    }

    pub(super) fn new(
        change: &Change,
        description: Option<String>,
        trend: Option<&Trend>,
        since: Timestamp,
        text: String,
    ) -> Self {
        let scale = change.baseline;
        Self {
            parameter: change.parameter.clone(),
            description,
            relative_change: finite(change.relative_change()),
            deviation_sigma: finite(change.difference_deviations()),
            slope_per_day: trend.and_then(|trend| finite(trend.slope / scale)),
            slope_sd: trend.and_then(|trend| finite(trend.slope_deviation / scale.abs())),
            since,
            text,
        }
    }
}
