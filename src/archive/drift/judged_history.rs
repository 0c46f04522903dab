//! The complete history, compared with its baseline.

use super::{Baseline, Change, Comparison, DriftOptions, NotComparable, Tracker};
use crate::archive::store::{HistoryLine, Timestamp};

/// One result of the history, judged with the data available at its time.
#[derive(Clone, Debug)]
pub struct Entry {
    /// History line of the result.
    pub line: HistoryLine,
    /// Comparison with the baseline. `None` for the baseline itself, for results before it, and
    /// without a baseline.
    pub comparison: Option<Result<Comparison, NotComparable>>,
    /// Parameters whose alarms were raised after this result.
    pub alarmed_parameters: Vec<String>,
}

impl Entry {
    /// Returns the change with the largest share of its band.
    pub fn largest_change(&self) -> Option<&Change> {
        let changes = &self.comparison.as_ref()?.as_ref().ok()?.changes;
        let judged = changes.iter().filter(|change| !change.band_share().is_nan());
        judged.max_by(|a, b| a.band_share().total_cmp(&b.band_share()))
    }
}

/// The history, judged against the baseline.
#[derive(Clone, Debug)]
pub struct JudgedHistory {
    /// The results, oldest first.
    pub entries: Vec<Entry>,
    /// Tracker that has processed the results. `None` without a baseline.
    pub tracker: Option<Tracker>,
    /// Drift options.
    pub options: DriftOptions,
}

impl JudgedHistory {
    /// Judges the lines in their order, oldest first.
    pub fn new(lines: Vec<HistoryLine>, baseline: Option<Baseline>, options: DriftOptions) -> Self {
        let mut tracker = baseline.map(|baseline| Tracker::new(baseline, options));
        let entries = lines.into_iter().map(|line| {
            let (mut compared, mut alarmed) = (None, Vec::new());
            if let Some(tracker) = &mut tracker
                && tracker.is_after_baseline(&line)
            {
                tracker.handle_line(&line);
                compared = Some(tracker.compare(&line));
                alarmed = tracker.alarms().map(|(name, _)| name.to_owned()).collect();
            }
            Entry { line, comparison: compared, alarmed_parameters: alarmed }
        });
        Self { entries: entries.collect(), tracker, options }
    }

    /// Returns true if the line is the baseline's result.
    pub fn is_baseline(&self, line: &HistoryLine) -> bool {
        self.tracker.as_ref().is_some_and(|tracker| {
            let baseline = &tracker.baseline().result;
            (line.result, line.time) == (baseline.result, baseline.time)
        })
    }

    /// Returns the newest result with this number.
    pub fn result(&self, number: u64) -> Option<&HistoryLine> {
        let mut newest_first = self.entries.iter().rev();
        newest_first.find(|entry| entry.line.result == number).map(|entry| &entry.line)
    }

    /// Returns the names of all parameters, in the order of the newest result that contains them.
    pub fn parameters(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for entry in self.entries.iter().rev() {
            for parameter in &entry.line.parameters {
                if !names.contains(&parameter.name.as_str()) {
                    names.push(&parameter.name);
                }
            }
        }
        names
    }

    /// Returns the unit of a parameter. It is empty if no result contains it.
    pub fn unit(&self, parameter: &str) -> &str {
        let newest_first = self.entries.iter().rev();
        let values = newest_first.filter_map(|entry| entry.line.parameter(parameter));
        values.map(|found| found.unit.as_str()).find(|unit| !unit.is_empty()).unwrap_or_default()
    }

    /// Returns the earliest and the latest time of a result. `None` if no result was stored with a
    /// set clock. Lines are in the order in which they were stored. A clock that was set back
    /// breaks the order of the times.
    pub fn time_range(&self) -> Option<(Timestamp, Timestamp)> {
        let times = self.entries.iter().map(|entry| entry.line.time).filter(|time| time.is_set());
        Some((times.clone().min()?, times.max()?))
    }

    /// Returns how many results were stored while the clock was not set. They are compared, but are
    /// not part of plots and trends.
    pub fn undated_count(&self) -> usize {
        self.entries.iter().filter(|entry| !entry.line.time.is_set()).count()
    }

    /// Returns this count as a sentence. `None` if it is zero.
    pub fn undated_text(&self) -> Option<String> {
        let (results, are) = match self.undated_count() {
            0 => return None,
            1 => ("1 result was".to_owned(), "is"),
            count => (format!("{count} results were"), "are"),
        };
        Some(format!(
            "{results} stored while the clock was not set and {are} left out of plots and trends"
        ))
    }

    /// Returns a parameter over time: days since the earliest result, value and standard deviation.
    /// Contains the results that are usable and were stored with a set clock, in the order of their
    /// times.
    pub fn parameter_points(&self, parameter: &str) -> Vec<(f64, f64, f64)> {
        let Some((start, _)) = self.time_range() else { return Vec::new() };
        let usable =
            |entry: &&Entry| entry.line.is_good_for_monitoring() && entry.line.time.is_set();
        let points = self.entries.iter().filter(usable).filter_map(|entry: &Entry| {
            let value_found = entry.line.parameter(parameter)?;
            let days = entry.line.time.days_after(start);
            Some((days, value_found.value, value_found.standard_deviation))
        });
        let mut points: Vec<_> = points.filter(|(_, value, _)| value.is_finite()).collect();
        points.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
        points
    }

    /// Returns the baseline value of a parameter and half of its band. The band is that of the last
    /// compared result. Without a compared result, it is computed from the baseline alone.
    pub fn baseline_band(&self, parameter: &str) -> Option<(f64, f64)> {
        let tracker = self.tracker.as_ref()?;
        let then = tracker.baseline().result.parameter(parameter)?;
        let change = tracker
            .last_change(parameter)
            .unwrap_or_else(|| Change::new(then, then, 0.0, &self.options));
        change.half_band.is_finite().then_some((then.value, change.half_band))
    }
}
