//! Pending history lines. They are saved on disk before their results are written.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};

use didim_identification::identification::Uses;

use super::error::{StoreError, io_error, write};
use super::history::{HistoryFile, HistoryLine};
use super::record::{Attachments, ResultRecord};
use super::timestamp::Timestamp;
use crate::files::{read_bytes, remove_if_there};

const FILE_NAME: &str = ".owed.jsonl";
/// Maximum number of pending lines. If more results are stored while their history lines are
/// refused, the oldest lines are lost.
const MAX_LINES: usize = 1000;

/// The pending lines and their file. The file exists while there are pending lines.
#[derive(Debug)]
pub(super) struct Pending {
    path: PathBuf,
    lines: VecDeque<HistoryLine>,
}

impl Pending {
    pub(super) fn in_folder(folder: &Path) -> Self {
        Self { path: folder.join(FILE_NAME), lines: VecDeque::new() }
    }

    pub(super) fn is_name(name: &str) -> bool {
        name == FILE_NAME
    }

    /// Reads the pending lines of a previous process. An unreadable file counts as empty.
    pub(super) fn read(&self) -> Vec<HistoryLine> {
        let content = read_bytes(&self.path).unwrap_or_default();
        let lines = content.split(|byte| *byte == b'\n');
        lines.filter_map(|line| serde_json::from_slice(line).ok()).collect()
    }

    pub(super) fn lines(&self) -> impl ExactSizeIterator<Item = &HistoryLine> {
        self.lines.iter()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    pub(super) fn has_result(&self, result: u64) -> bool {
        self.lines.iter().any(|line| line.result == result)
    }

    pub(super) fn add(&mut self, line: HistoryLine) {
        self.lines.push_back(line);
    }

    /// Removes the last added line after its result could not be stored.
    pub(super) fn take_back(&mut self) {
        self.lines.pop_back();
    }

    /// Writes the pending lines to disk.
    pub(super) fn write(&self) -> Result<(), StoreError> {
        let mut content = Vec::new();
        for line in &self.lines {
            serde_json::to_writer(&mut content, line)?;
            content.push(b'\n');
        }
        write(&self.path, &content)
    }

    /// Appends the pending lines to the history. All their results are stored. Drops the oldest
    /// lines beyond the maximum number.
    pub(super) fn settle(&mut self, history: &mut HistoryFile) -> Result<(), StoreError> {
        let settled = self.append_to(history);
        while self.lines.len() > MAX_LINES {
            tracing::warn!(
                "the history could not be written for {MAX_LINES} results, and loses a line"
            );
            self.lines.pop_front();
        }
        settled
    }

    fn append_to(&mut self, history: &mut HistoryFile) -> Result<(), StoreError> {
        if self.lines.is_empty() {
            return Ok(());
        }
        while let Some(line) = self.lines.front() {
            history.append(line)?;
            self.lines.pop_front();
        }
        self.remove_if_empty()
    }

    /// Removes the file if there are no pending lines.
    pub(super) fn remove_if_empty(&self) -> Result<(), StoreError> {
        remove_if_there(&self.path).map_err(io_error("remove", &self.path))
    }
}

/// Rebuilds the missing history line of a result from its file, without the note. The date is that
/// of the file. The hash of the parameters' composition comes from other lines of the same
/// configuration.
pub(super) fn line_of(
    path: &Path,
    number: u64,
    others: &VecDeque<HistoryLine>,
) -> Option<HistoryLine> {
    let record: ResultRecord = serde_json::from_slice(&fs::read(path).ok()?).ok()?;
    let time = Timestamp::of_file(path).ok()?;
    let alike = others.iter().rev().find(|line| line.configuration == record.configuration);
    let regrouping = alike.map(|line| line.regrouping.clone()).unwrap_or_default();
    let attachments = Attachments { regrouping, ..Attachments::default() };
    let line = HistoryLine::new(number, &record, &attachments, time);
    // Results of earlier versions have one verdict for every use.
    let has_uses = record.estimate.verdict.uses != Uses::default();
    Some(HistoryLine { monitoring: line.monitoring.filter(|_| has_uses), ..line })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::archive::store::HISTORY_SCHEMA;
    use crate::window::DriveReadings;

    fn line(result: u64) -> HistoryLine {
        HistoryLine {
            schema: HISTORY_SCHEMA,
            time: Timestamp::from_unix_s(0),
            recorded: None,
            result,
            cell: String::new(),
            robot: String::new(),
            regrouping: String::new(),
            configuration: String::new(),
            method: String::new(),
            applicable: true,
            monitoring: None,
            uses: BTreeMap::default(),
            relative_error: None,
            note: None,
            parameters: Vec::new(),
            against: None,
            load: None,
            day: None,
            readings: DriveReadings::default(),
        }
    }

    #[test]
    fn only_a_result_that_is_stored_costs_the_oldest_line() {
        let folder = tempfile::tempdir().unwrap();
        let (mut history, _) = HistoryFile::open(folder.path(), 10, 10).unwrap();
        // Makes appending fail, for root as well.
        fs::create_dir(folder.path().join("history.jsonl")).unwrap();
        let mut pending = Pending::in_folder(folder.path());
        let most = MAX_LINES as u64;
        (0..most).for_each(|result| pending.add(line(result)));
        for _ in 0..3 {
            pending.add(line(most));
            pending.take_back();
        }
        assert!(pending.settle(&mut history).is_err());
        assert!(pending.has_result(0) && pending.lines().len() == MAX_LINES);
        pending.add(line(most));
        assert!(pending.settle(&mut history).is_err());
        assert!(
            !pending.has_result(0)
                && pending.has_result(most)
                && pending.lines().len() == MAX_LINES
        );
    }
}
