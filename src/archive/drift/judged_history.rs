//! The whole history, compared with its baseline.

use super::{Baseline, Change, Comparison, DriftOptions, NotComparable, Tracker};
use crate::archive::store::{HistoryLine, Timestamp};

/// One result of the history, judged as of its time.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its line.
    pub line: HistoryLine,
    /// How it compares with the baseline; nothing for it, for results before it, and without one.
    pub compared: Option<Result<Comparison, NotComparable>>,
    /// The parameters whose alarms were raised after it.
    pub alarmed: Vec<String>,
}

impl Entry {
    /// The change that uses the most of its band.
    pub fn largest_change(&self) -> Option<&Change> {
        let changes = &self.compared.as_ref()?.as_ref().ok()?.changes;
        let judged = changes.iter().filter(|change| !change.band_share().is_nan());
        judged.max_by(|a, b| a.band_share().total_cmp(&b.band_share()))
    }
}

/// The history, judged by the baseline.
#[derive(Clone, Debug)]
pub struct JudgedHistory {
    /// The results, oldest first.
    pub entries: Vec<Entry>,
    /// The tracker that followed them; nothing without a baseline.
    pub tracker: Option<Tracker>,
    /// What counts as drift.
    pub options: DriftOptions,
}

impl JudgedHistory {
    /// Follows the lines from the first to the last.
    pub fn new(lines: Vec<HistoryLine>, baseline: Option<Baseline>, options: DriftOptions) -> Self {
        let mut tracker = baseline.map(|baseline| Tracker::new(baseline, options));
        let entries = lines.into_iter().map(|line| {
            let (mut compared, mut alarmed) = (None, Vec::new());
            if let Some(tracker) = &mut tracker
                && tracker.follows(&line)
            {
                tracker.handle_line(&line);
                compared = Some(tracker.compare(&line));
                alarmed = tracker.alarms().map(|(name, _)| name.to_owned()).collect();
            }
            Entry { line, compared, alarmed }
        });
        Self { entries: entries.collect(), tracker, options }
    }

    /// Whether it is the baseline's result.
    pub fn is_baseline(&self, line: &HistoryLine) -> bool {
        self.tracker.as_ref().is_some_and(|tracker| {
            let baseline = &tracker.baseline().result;
            (line.result, line.time) == (baseline.result, baseline.time)
        })
    }

    /// The newest result of a number.
    pub fn result(&self, number: u64) -> Option<&HistoryLine> {
        let mut newest_first = self.entries.iter().rev();
        newest_first.find(|entry| entry.line.result == number).map(|entry| &entry.line)
    }

    /// The names of all parameters, in the order of the newest result that has them.
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

    /// The unit of a parameter; empty where no result says it.
    pub fn unit(&self, parameter: &str) -> &str {
        let newest_first = self.entries.iter().rev();
        let found = newest_first.filter_map(|entry| entry.line.parameter(parameter));
        found.map(|found| found.unit.as_str()).find(|unit| !unit.is_empty()).unwrap_or_default()
    }

    /// The earliest time of a result and the latest; nothing when none was stored with a set clock.
    /// Lines stand in the order in which they were stored, which a clock that was set back does not
    /// keep.
    pub fn extent(&self) -> Option<(Timestamp, Timestamp)> {
        let times = self.entries.iter().map(|entry| entry.line.time).filter(|time| time.is_set());
        Some((times.clone().min()?, times.max()?))
    }

    /// How many results were stored while the clock was not set: they are compared, and are no part
    /// of plots and trends.
    pub fn undated(&self) -> usize {
        self.entries.iter().filter(|entry| !entry.line.time.is_set()).count()
    }

    /// The same as a sentence; nothing when there is none.
    pub fn undated_text(&self) -> Option<String> {
        let (results, are) = match self.undated() {
            0 => return None,
            1 => ("1 result was".to_owned(), "is"),
            count => (format!("{count} results were"), "are"),
        };
        Some(format!(
            "{results} stored while the clock was not set and {are} left out of plots and trends"
        ))
    }

    /// A parameter over time: days since the earliest result, value and standard deviation, of the
    /// results that may be used and were stored with a set clock, in the order of their times.
    pub fn points(&self, parameter: &str) -> Vec<(f64, f64, f64)> {
        let Some((start, _)) = self.extent() else { return Vec::new() };
        let usable =
            |entry: &&Entry| entry.line.is_good_for_monitoring() && entry.line.time.is_set();
        let point = |entry: &Entry| {
            let found = entry.line.parameter(parameter)?;
            let days = entry.line.time.days_after(start);
            Some((days, found.value, found.standard_deviation))
        };
        let points = self.entries.iter().filter(usable).filter_map(point);
        let mut points: Vec<_> = points.filter(|(_, value, _)| value.is_finite()).collect();
        points.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
        points
    }

    /// The baseline's value of a parameter and half of its band, as of the last result that was
    /// compared, or of the baseline alone.
    pub fn band(&self, parameter: &str) -> Option<(f64, f64)> {
        let tracker = self.tracker.as_ref()?;
        let then = tracker.baseline().result.parameter(parameter)?;
        let change = tracker
            .last_change(parameter)
            .unwrap_or_else(|| Change::new(then, then, 0.0, &self.options));
        change.half_band.is_finite().then_some((then.value, change.half_band))
    }
}
