//! Values of a row of the history that stands for the results of a day.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::archive::store::timestamp::Timestamp;

/// Further values of a row that stands for the results of a day. The values of the parameters are
/// the weighted means of the results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DaySummary {
    /// Number of results.
    pub results: u64,
    /// Time of the first result.
    pub first: Timestamp,
    /// Time of the last result.
    pub last: Timestamp,
    /// Standard deviation between the results, of each parameter in its unit. `None` for a single
    /// result.
    pub scatter: Vec<Option<f64>>,
    /// Median motor temperature \[°C\], if drives report one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Median mass of the load relative to the baseline \[kg\], if one was identified.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_kg: Option<f64>,
    /// Number of the segment whose lines the row replaces.
    pub segment: u64,
    /// State of the alarms after the last result of the segment, with its last row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alarms: Option<AlarmCheckpoint>,
}

/// State of the alarms after a result, for one baseline and one set of limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlarmCheckpoint {
    /// Number of the baseline's result.
    pub baseline: u64,
    /// Time of the baseline's result.
    pub baseline_time: Timestamp,
    /// Half of the band, in standard deviations \[σ\].
    pub standard_deviations: f64,
    /// Half of the band, as a share of the baseline's value \[1\].
    pub relative: f64,
    /// Number of results in a row that change an alarm.
    pub results: u32,
    /// Alarms that are raised or about to be, by the name of the parameter.
    pub alarms: BTreeMap<String, AlarmState>,
}

/// State of the alarm of one parameter.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmState {
    /// Number of consecutive results that support a state change: outside the band while the alarm
    /// is clear, well inside it while the alarm is raised.
    pub agreeing_results: u32,
    /// Time of the first of the consecutive results outside the band.
    pub left_band_at: Option<Timestamp>,
    /// True if the alarm is raised.
    pub is_raised: bool,
}
