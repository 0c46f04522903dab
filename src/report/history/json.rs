//! The history as JSON, for scripts.

use serde::ser::{Error as _, SerializeSeq};
use serde::{Serialize, Serializer};

use super::Difference;
use crate::archive::drift::{AlarmStatus, Baseline, Entry, JudgedHistory, Trend};
use crate::archive::store::HistoryLine;

/// The JSON object with all data of a history.
#[derive(Clone, Debug, Serialize)]
pub struct HistoryDocument<'a> {
    /// Version of its layout. It changes when a key changes its meaning or is removed.
    pub schema: u32,
    /// Number of skipped lines of the file: incomplete lines, lines of other programs, and lines of
    /// a later version.
    pub passed_over: usize,
    /// Number of results that were stored while the clock was not set. The trends do not include
    /// them.
    pub undated: u64,
    /// The baseline.
    pub baseline: Option<&'a Baseline>,
    /// The results, oldest first.
    pub results: ResultDocuments<'a>,
    /// Raised alarms.
    pub alarms: Vec<AlarmStatus>,
    /// The trends of the parameters, in SI units over days since the baseline.
    pub trends: Vec<TrendDocument>,
    /// Comparison of two results, if requested.
    pub difference: Option<Difference>,
}

/// The results of a history. They are read while they are written, so that they take no memory.
#[derive(Clone, Copy, Debug)]
pub struct ResultDocuments<'a>(&'a JudgedHistory);

impl Serialize for ResultDocuments<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut results = serializer.serialize_seq(None)?;
        let mut written = Ok(());
        let read = self.0.for_each_entry(|entry| {
            if written.is_ok() {
                written = results.serialize_element(&ResultDocument::new(entry));
            }
        });
        read.map_err(S::Error::custom)?;
        written?;
        results.end()
    }
}

/// A result and its comparison with the baseline.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ResultDocument<'a> {
    /// History line of the result.
    #[serde(flatten)]
    pub line: &'a HistoryLine,
    /// True if the result was compared with the baseline.
    pub compared: bool,
    /// Reason why the result was not compared.
    pub why_not: Option<String>,
    /// Parameters outside their bands.
    pub outside: Vec<String>,
    /// Parameters whose alarms were raised after this result.
    pub alarmed: &'a [String],
}

/// A straight line through the days of the compared results.
#[derive(Clone, Debug, Serialize)]
pub struct TrendDocument {
    /// The parameter.
    pub parameter: String,
    /// Unit of the parameter. The slope is in this unit per day. Empty if no history line contains
    /// the unit.
    pub unit: String,
    /// Number of days with results. Each day is one point of the trend.
    pub points: usize,
    /// Slope per day.
    pub slope_per_day: f64,
    /// Standard deviation of the slope.
    pub slope_sd: f64,
    /// Ratio of the scatter of the days to their standard deviations, but at least 1.
    pub scatter: f64,
}

impl<'a> ResultDocument<'a> {
    fn new(entry: &'a Entry) -> Self {
        let compared = entry.comparison.as_ref();
        let outside = compared.and_then(|compared| compared.as_ref().ok()).map(|compared| {
            let outside = compared.changes.iter().filter(|change| change.band_share() > 1.0);
            outside.map(|change| change.parameter.clone()).collect()
        });
        Self {
            line: &entry.line,
            compared: matches!(compared, Some(Ok(_))),
            why_not: compared.and_then(|compared| Some(compared.as_ref().err()?.to_string())),
            outside: outside.unwrap_or_default(),
            alarmed: &entry.alarmed_parameters,
        }
    }
}

impl<'a> HistoryDocument<'a> {
    /// Creates the document of all results, with the trends of these parameters.
    pub fn new(
        history: &'a JudgedHistory,
        parameters: &[&str],
        difference: Option<Difference>,
    ) -> Self {
        let tracker = history.tracker.as_ref();
        let trends = parameters.iter().filter_map(|name| {
            let Trend { points, slope, slope_deviation, scatter, .. } = tracker?.trend(name)?;
            Some(TrendDocument {
                parameter: (*name).to_owned(),
                unit: history.unit(name).to_owned(),
                points,
                slope_per_day: slope,
                slope_sd: slope_deviation,
                scatter,
            })
        });
        Self {
            schema: 1,
            passed_over: history.passed_over,
            undated: history.undated_count(),
            baseline: tracker.map(|tracker| tracker.baseline()),
            results: ResultDocuments(history),
            alarms: tracker.map_or(Vec::new(), |tracker| tracker.status().alarms),
            trends: trends.collect(),
            difference,
        }
    }
}
