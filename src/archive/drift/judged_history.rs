//! The complete history, compared with its baseline.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::thinned_history::ThinnedHistory;
use super::{Baseline, Change, DriftOptions, Entry, Tracker};
use crate::archive::store::{HistoryError, HistoryLine, ParameterValue, Timestamp, for_each_line};

/// A history, judged against the baseline.
///
/// A history that is read from a folder takes the same memory, however long it is: the newest
/// results are in `entries` as they are, and older ones as rows of days.
/// [`Self::for_each_entry`] has all of them.
#[derive(Clone, Debug)]
pub struct JudgedHistory {
    /// The results, oldest first.
    pub entries: Vec<Entry>,
    /// Tracker that has processed the results. `None` without a baseline.
    pub tracker: Option<Tracker>,
    /// Drift options.
    pub options: DriftOptions,
    /// Number of lines that were skipped: incomplete lines, and lines of other programs or of a
    /// later version.
    pub passed_over: usize,
    /// The results that were requested by their numbers.
    requested: Vec<HistoryLine>,
    /// Source of the results, if `entries` has rows of days in their place.
    thinned: Option<ThinnedSource>,
}

/// Source of results that are rows of days in memory.
#[derive(Clone, Debug)]
struct ThinnedSource {
    folder: PathBuf,
    /// Range of the shown lines.
    shown: Range<usize>,
    /// Number of rows of days in the file, which come first.
    stored_rows: usize,
    /// Number of rows of days that replace results.
    made_rows: usize,
}

/// Judges a line with the lines before it.
fn judge(tracker: &mut Option<Tracker>, line: HistoryLine) -> Entry {
    let (mut compared, mut alarmed) = (None, Vec::new());
    if let Some(tracker) = tracker
        && tracker.is_after_baseline(&line)
    {
        tracker.handle_line(&line);
        compared = Some(tracker.compare(&line));
        alarmed = tracker.alarms().map(|(name, _)| name.to_owned()).collect();
    }
    Entry { line, comparison: compared, alarmed_parameters: alarmed }
}

impl JudgedHistory {
    /// Judges the lines in their order, oldest first.
    pub fn new(lines: Vec<HistoryLine>, baseline: Option<Baseline>, options: DriftOptions) -> Self {
        let mut tracker = baseline.map(|baseline| Tracker::new(baseline, options));
        let entries = lines.into_iter().map(|line| judge(&mut tracker, line)).collect();
        Self { entries, tracker, options, passed_over: 0, requested: Vec::new(), thinned: None }
    }

    /// Reads the history of a results folder and judges it. [`Self::result`] finds the requested
    /// results, however old they are.
    ///
    /// # Errors
    /// [`HistoryError`].
    pub fn read(
        folder: &Path,
        baseline: Option<Baseline>,
        options: DriftOptions,
        requested: &[u64],
    ) -> Result<Self, HistoryError> {
        let mut tracker = baseline.map(|baseline| Tracker::new(baseline, options));
        let (mut thinned, mut lines) = (ThinnedHistory::default(), 0);
        let mut newest_requested = BTreeMap::new();
        let passed_over = for_each_line(folder, |line| {
            lines += 1;
            if requested.contains(&line.result) && line.day.is_none() {
                newest_requested.insert(line.result, line.clone());
            }
            let entry = judge(&mut tracker, line);
            thinned.add(entry, tracker.as_ref());
        })?;
        thinned.close_day(tracker.as_ref());
        let source = ThinnedSource {
            folder: folder.to_owned(),
            shown: 0..lines,
            stored_rows: thinned.stored.len(),
            made_rows: thinned.made.len(),
        };
        Ok(Self {
            thinned: Some(source).filter(|source| source.made_rows > 0),
            entries: thinned.into_entries(),
            tracker,
            options,
            passed_over,
            requested: newest_requested.into_values().collect(),
        })
    }

    /// Keeps only this number of the newest lines. They are judged with those before them.
    pub fn keep_last(&mut self, last: usize) {
        let Some(source) = &mut self.thinned else {
            let surplus = self.entries.len().saturating_sub(last);
            self.entries.drain(..surplus);
            return;
        };
        source.shown.start = source.shown.end.saturating_sub(last);
        let rows = source.stored_rows + source.made_rows;
        let in_full = self.entries.len() - rows;
        if last <= in_full {
            self.entries.drain(..self.entries.len() - last);
            self.thinned = None;
            return;
        }
        // The oldest row may also stand for results that are not shown.
        let mut missing = last - in_full;
        let mut first = rows;
        while missing > 0 && first > 0 {
            first -= 1;
            let day = self.entries[first].line.day.as_ref().filter(|_| first >= source.stored_rows);
            let lines = day.map_or(1, |day| usize::try_from(day.results).unwrap_or(usize::MAX));
            missing = missing.saturating_sub(lines);
        }
        self.entries.drain(..first);
        source.made_rows = rows - first.max(source.stored_rows);
        source.stored_rows = source.stored_rows.saturating_sub(first);
    }

    /// Returns the number of results in memory, as they are and as rows of days.
    pub fn result_count(&self) -> u64 {
        let results = |entry: &Entry| entry.line.day.as_ref().map_or(1, |day| day.results);
        self.entries.iter().map(results).sum()
    }

    /// Calls a function with each line, oldest first. Reads the folder again, if the lines are not
    /// in memory.
    ///
    /// # Errors
    /// [`HistoryError`].
    pub fn for_each_entry(&self, mut take: impl FnMut(&Entry)) -> Result<(), HistoryError> {
        let Some(source) = &self.thinned else {
            self.entries.iter().for_each(take);
            return Ok(());
        };
        let baseline = self.tracker.as_ref().map(|tracker| tracker.baseline().clone());
        let mut tracker = baseline.map(|baseline| Tracker::new(baseline, self.options));
        let mut index = 0;
        for_each_line(&source.folder, |line| {
            // Lines that came since the first reading are left out.
            if index < source.shown.end {
                let entry = judge(&mut tracker, line);
                if source.shown.contains(&index) {
                    take(&entry);
                }
            }
            index += 1;
        })?;
        Ok(())
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
        let newest_first = self.entries.iter().rev().map(|entry| &entry.line);
        self.requested.iter().chain(newest_first).find(|line| line.result == number)
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

    /// Returns what a parameter describes, by the names of the robot file. `None` if no result says
    /// so.
    pub fn description(&self, parameter: &str) -> Option<&str> {
        let newest_first = self.entries.iter().rev();
        let mut values = newest_first.filter_map(|entry| entry.line.parameter(parameter));
        values.find_map(|found| found.description.as_deref())
    }

    /// Returns the name of a parameter with that of its joint or link, if a result has it:
    /// `fc3 (elbow_joint)`.
    pub fn parameter_and_part(&self, parameter: &str) -> String {
        let newest_first = self.entries.iter().rev();
        let mut values = newest_first.filter_map(|entry| entry.line.parameter(parameter));
        match values.find_map(ParameterValue::part_name) {
            Some(part) => format!("{parameter} ({part})"),
            None => parameter.to_owned(),
        }
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
    pub fn undated_count(&self) -> u64 {
        let undated = self.entries.iter().filter(|entry| !entry.line.time.is_set());
        undated.map(|entry| entry.line.day.as_ref().map_or(1, |day| day.results)).sum()
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
