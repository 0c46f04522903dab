//! A history in bounded memory: the newest results, and rows of days in place of older ones.

use std::collections::VecDeque;

use super::{Entry, Tracker};
use crate::archive::store::{HistoryLine, day_rows};

/// Number of the newest results that stay as they are \[1\]. Convention: a result takes some 10 kB,
/// and a chart of more points is a band.
const NEWEST_IN_FULL: usize = 1_000;

/// The entries, oldest first.
#[derive(Debug, Default)]
pub(super) struct ThinnedHistory {
    /// Rows of days of the file.
    pub(super) stored: Vec<Entry>,
    /// Rows that replace results.
    pub(super) made: Vec<Entry>,
    /// Results of the day that is being replaced, and the alarms after the last one.
    day: (Vec<HistoryLine>, Vec<String>),
    newest: VecDeque<Entry>,
}

impl ThinnedHistory {
    /// Adds an entry. The tracker has processed it.
    pub(super) fn add(&mut self, entry: Entry, tracker: Option<&Tracker>) {
        if entry.line.day.is_some() && self.newest.is_empty() {
            return self.stored.push(entry);
        }
        self.newest.push_back(entry);
        if self.newest.len() <= NEWEST_IN_FULL {
            return;
        }
        let Some(Entry { line, alarmed_parameters, .. }) = self.newest.pop_front() else { return };
        let (lines, alarmed) = &mut self.day;
        if lines.first().is_some_and(|first| first.time.day() != line.time.day()) {
            self.close_day(tracker);
        } else if lines.len() >= NEWEST_IN_FULL {
            *lines = day_rows(lines, 0);
            if 2 * lines.len() >= NEWEST_IN_FULL {
                self.close_day(tracker);
            }
        } else {
            *alarmed = alarmed_parameters;
            return lines.push(line);
        }
        self.day.0.push(line);
        self.day.1 = alarmed_parameters;
    }

    /// Replaces the results of the open day by its rows.
    pub(super) fn close_day(&mut self, tracker: Option<&Tracker>) {
        let (lines, alarmed) = std::mem::take(&mut self.day);
        for line in day_rows(&lines, 0) {
            let tracker = tracker.filter(|tracker| tracker.is_after_baseline(&line));
            let comparison = tracker.map(|tracker| tracker.compare(&line));
            let alarmed_parameters = alarmed.clone();
            self.made.push(Entry { line, comparison, alarmed_parameters });
        }
    }

    /// Returns the entries.
    pub(super) fn into_entries(self) -> Vec<Entry> {
        let rows = self.stored.into_iter().chain(self.made);
        rows.chain(self.newest).collect()
    }
}
