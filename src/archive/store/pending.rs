//! Pending history lines. They are saved on disk before their results are written.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use std::{fs, io};

use didim_formats::RecordingStart;
use serde::Deserialize;

use super::error::{StoreError, io_error, write};
use super::history::{HISTORY_SCHEMA, HistoryFile, HistoryLine, ParameterValue};
use super::timestamp::Timestamp;
use crate::files::read_bytes;
use crate::window::DriveReadings;

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
        match fs::remove_file(&self.path) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                Err(io_error("remove", &self.path)(cause))
            }
            _ => Ok(()),
        }
    }
}

/// The fields of a result file that its history line needs.
#[derive(Deserialize)]
struct ResultFile {
    #[serde(default)]
    cell: String,
    configuration: String,
    #[serde(default)]
    window: Recorded,
    estimate: Estimate,
}

#[derive(Default, Deserialize)]
struct Recorded {
    recorded: Option<RecordingStart>,
    #[serde(flatten)]
    readings: DriveReadings,
}

#[derive(Deserialize)]
struct Estimate {
    robot: String,
    method: String,
    relative_error: Option<f64>,
    verdict: Verdict,
    parameters: Vec<ParameterValue>,
}

#[derive(Deserialize)]
struct Verdict {
    applicable: bool,
    uses: Option<BTreeMap<String, Use>>,
}

#[derive(Deserialize)]
struct Use {
    applicable: Option<bool>,
}

/// Rebuilds the missing history line of a result from its file, without the note. The date is that
/// of the file. The hash of the parameters' composition comes from other lines of the same
/// configuration.
pub(super) fn line_of(
    path: &Path,
    number: u64,
    others: &VecDeque<HistoryLine>,
) -> Option<HistoryLine> {
    let ResultFile { cell, configuration, window, estimate } =
        serde_json::from_slice(&fs::read(path).ok()?).ok()?;
    let stored = fs::metadata(path).and_then(|data| data.modified()).ok()?;
    let alike = others.iter().rev().find(|line| line.configuration == configuration);
    let Estimate { robot, method, relative_error, verdict, parameters } = estimate;
    let uses = verdict.uses.map(|uses| {
        let answers = uses.into_iter().filter_map(|(name, of)| Some((name, of.applicable?)));
        answers.collect::<BTreeMap<_, _>>()
    });
    Some(HistoryLine {
        schema: HISTORY_SCHEMA,
        time: Timestamp::from_unix_s(stored.duration_since(UNIX_EPOCH).ok()?.as_secs()),
        recorded: window.recorded,
        result: number,
        cell,
        robot,
        regrouping: alike.map(|line| line.regrouping.clone()).unwrap_or_default(),
        configuration,
        method,
        applicable: verdict.applicable,
        monitoring: uses.as_ref().map(|uses| uses.get("monitoring") == Some(&true)),
        uses: uses.unwrap_or_default(),
        relative_error,
        note: None,
        parameters,
        against: None,
        load: None,
        readings: window.readings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
