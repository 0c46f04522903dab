//! The folder of the results.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::configurations::{ConfigurationTexts, Configurations};
use super::error::{StoreError, io_error, write};
use super::history::{HistoryFile, HistoryLine, RECENT_RESULTS, day_rows, is_history_file};
use super::pending::{Pending, line_of};
use super::record::{Attachments, ResultRecord};
use super::timestamp::Timestamp;
use crate::files::{lock_folder, remove_if_there, remove_leftovers, replace_link, with_disk};

/// Number of kept results unless the cell file sets another.
pub const DEFAULT_KEEP: usize = 1000;

/// Number of history lines among which a start looks for pending ones.
const RECENT_LINES: usize = 1000;

pub(crate) const LATEST_FILE: &str = "latest.json";

/// A folder of results, `result-00000000.json` and following. `latest.json` is a link to the newest
/// result. `history.jsonl` has one line per result, with its date. `configurations` has a folder
/// for each configuration of the results.
///
/// Only one process writes into the folder, because it is locked while this value exists. The
/// numbers continue after a restart, so that no result is overwritten. Files with other names are
/// not changed.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// The folder itself, locked.
    _locked: File,
    max_results: usize,
    next_number: u64,
    history: HistoryFile,
    /// Lines of stored results that have not been appended to the history yet.
    pending_lines: Pending,
    /// Reason why the pending lines could not be appended.
    refusal: Option<String>,
    configurations: Configurations,
}

impl Store {
    /// Opens the folder, and creates it if necessary. At most `keep` results are kept, but at least
    /// one.
    ///
    /// # Errors
    /// [`StoreError::Io`] and [`StoreError::InUse`].
    pub fn open(folder: &Path, keep: usize) -> Result<Self, StoreError> {
        with_disk(|disk| disk.make_folder(folder)).map_err(io_error("make the folder", folder))?;
        let locked = lock_folder(folder)
            .map_err(io_error("lock the folder", folder))?
            .ok_or_else(|| StoreError::InUse { folder: folder.to_owned() })?;
        let lines = keep.max(RECENT_RESULTS);
        let (history, mut recent) = HistoryFile::open(folder, lines, RECENT_LINES)?;
        let mut store = Self {
            folder: folder.to_owned(),
            _locked: locked,
            max_results: keep.max(1),
            next_number: 0,
            history,
            pending_lines: Pending::in_folder(folder),
            refusal: None,
            configurations: Configurations::next_to_results(folder),
        };
        store.configurations.clear_unfinished()?;
        // Incomplete files that a killed process has left behind.
        remove_leftovers(folder, |name: &str| {
            name == LATEST_FILE
                || Pending::is_name(name)
                || is_history_file(name)
                || index(name).is_some()
        })
        .map_err(io_error("clean up the folder", folder))?;
        let indices = store.result_numbers()?;
        // A number is not used again after its result was removed, because the history has it.
        let next = indices.last().map_or(0, |last| last.saturating_add(1));
        store.next_number = next.max(store.history.next_result());
        store.complete_history(&indices, &mut recent)?;
        Ok(store)
    }

    /// Replaces the oldest part of the history by rows of days, if it is older than two weeks.
    /// `complete` may add to the rows, and gets the lines that they stand for. Does nothing in most
    /// calls.
    ///
    /// # Errors
    /// [`StoreError`]; the history is complete nevertheless.
    pub fn summarise_days(
        &mut self,
        now: Timestamp,
        complete: impl FnOnce(&mut [HistoryLine], &[HistoryLine]),
    ) -> Result<(), StoreError> {
        let Some((segment, lines)) = self.history.outdated_segment(now)? else { return Ok(()) };
        let mut rows = day_rows(&lines, segment);
        complete(&mut rows, &lines);
        self.history.replace_oldest_segment(&rows)
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Stores the texts of a configuration. The results refer to them by the hash.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn keep_configuration(
        &self,
        sha256: &str,
        texts: &ConfigurationTexts,
    ) -> Result<(), StoreError> {
        self.configurations.store_texts(sha256, texts)
    }

    /// Returns the history line that [`Self::write`] will store.
    pub fn next_line(
        &self,
        record: &ResultRecord,
        auxiliary: &Attachments,
        now: Timestamp,
    ) -> HistoryLine {
        HistoryLine::new(self.next_number, record, auxiliary, now)
    }

    /// Writes a result and its history line. The line is saved as pending before the result is
    /// written, so that a killed process loses neither. Then renews the link and removes the oldest
    /// results beyond the number to keep. A failure of these steps is only logged, because the
    /// result is stored. If the line cannot be appended, the next call and the next start try
    /// again.
    ///
    /// # Errors
    /// [`StoreError`]; the previous content is unchanged.
    pub fn write(
        &mut self,
        record: &ResultRecord,
        auxiliary: &Attachments,
        now: Timestamp,
    ) -> Result<Stored, StoreError> {
        let mut json = serde_json::to_vec(record)?;
        json.push(b'\n');
        let number = self.next_number;
        let path = self.folder.join(name(number));
        let line = self.next_line(record, auxiliary, now);
        self.pending_lines.add(line.clone());
        let written = self.pending_lines.write().and_then(|()| write(&path, &json));
        if let Err(error) = written {
            self.pending_lines.take_back();
            return Err(error);
        }
        self.next_number = self.next_number.saturating_add(1);
        let remembered = self.settle();
        let linked = self.link_latest(number);
        let pruned = self.prune(&record.configuration);
        for problem in [remembered, linked, pruned].into_iter().filter_map(Result::err) {
            tracing::warn!("{} is stored, but: {problem}", path.display());
        }
        Ok(Stored { number, path, json, line })
    }

    /// Makes `latest.json` a link to a result.
    fn link_latest(&self, number: u64) -> Result<(), StoreError> {
        let link = self.folder.join(LATEST_FILE);
        replace_link(&link, &name(number)).map_err(io_error("link", &link))
    }

    /// Completes the history after a previous process stored a result without its history line,
    /// because it was killed or its disk was full. If the line was not saved as pending, it is
    /// rebuilt from the result.
    fn complete_history(
        &mut self,
        indices: &[u64],
        recent: &mut VecDeque<HistoryLine>,
    ) -> Result<(), StoreError> {
        for line in self.pending_lines.read() {
            let is_same =
                |other: &HistoryLine| (other.result, other.time) == (line.result, line.time);
            if indices.contains(&line.result) && !recent.iter().any(is_same) {
                self.pending_lines.add(line);
            }
        }
        for number in indices.iter().copied().filter(|number| self.history.is_missing(*number)) {
            if self.pending_lines.has_result(number) {
                continue;
            }
            let path = self.folder.join(name(number));
            match line_of(&path, number, recent) {
                Some(line) => self.pending_lines.add(line),
                None => {
                    tracing::warn!("{}: it cannot be added to the history", path.display())
                }
            }
        }
        if let Some(newest) = indices.last()
            && fs::read_link(self.folder.join(LATEST_FILE)).ok() != Some(name(*newest).into())
            && let Err(problem) = self.link_latest(*newest)
        {
            tracing::warn!("{problem}");
        }
        if self.pending_lines.is_empty() {
            return self.pending_lines.remove_if_empty();
        }
        tracing::warn!(
            "{}: history lines that an earlier run did not write: {}",
            self.folder.display(),
            self.pending_lines.lines().len()
        );
        recent.extend(self.pending_lines.lines().cloned());
        while recent.len() > RECENT_LINES {
            recent.pop_front();
        }
        self.pending_lines.write()?;
        if let Err(problem) = self.settle() {
            tracing::warn!("they are not written yet: {problem}");
        }
        Ok(())
    }

    /// Appends the pending lines to the history.
    ///
    /// # Errors
    /// [`StoreError::Io`]; they are tried again.
    pub fn settle(&mut self) -> Result<(), StoreError> {
        let settled = self.pending_lines.settle(&mut self.history);
        self.refusal = settled.as_ref().err().map(ToString::to_string);
        settled
    }

    /// Returns the lines of stored results that the history does not have yet.
    pub fn pending_lines(&self) -> impl Iterator<Item = &HistoryLine> {
        self.pending_lines.lines()
    }

    /// Returns the number of pending history lines, and the reason.
    pub fn pending_count(&self) -> (usize, Option<&str>) {
        (self.pending_lines.lines().len(), self.refusal.as_deref())
    }

    /// Removes the oldest results beyond the number to keep, with the reports that earlier versions
    /// wrote. Also removes the configurations that only they refer to.
    fn prune(&self, current: &str) -> Result<(), StoreError> {
        let indices = self.result_numbers()?;
        let surplus = indices.len().saturating_sub(self.max_results);
        let mut removed = Ok(());
        for index in indices.into_iter().take(surplus) {
            // The report is removed first. If its result were removed first, nothing would remove
            // the report after a failure.
            let report = self.folder.join(report_name(index));
            removed = removed.and(remove_if_there(&report).map_err(io_error("remove", &report)));
            let path = self.folder.join(name(index));
            let gone = with_disk(|disk| disk.remove(&path));
            removed = removed.and(gone.map_err(io_error("remove", &path)));
        }
        removed.and_then(|()| if surplus > 0 { self.prune_configurations(current) } else { Ok(()) })
    }

    /// Removes every configuration that is not the current one and that no result refers to. If
    /// only the current configuration is stored, no result is read.
    fn prune_configurations(&self, current: &str) -> Result<(), StoreError> {
        let mut unused = self.configurations.stored_hashes()?;
        unused.retain(|sha256| sha256 != current);
        // An older configuration belongs to the oldest results, so the search begins with them.
        for index in self.result_numbers()? {
            if unused.is_empty() {
                return Ok(());
            }
            let path = self.folder.join(name(index));
            let content = fs::read(&path).map_err(io_error("read", &path))?;
            match serde_json::from_slice::<ConfigurationReference>(&content) {
                Ok(result) => unused.retain(|sha256| *sha256 != result.configuration),
                // An unreadable result may refer to any configuration.
                Err(_) => return Ok(()),
            }
        }
        if !unused.is_empty() {
            // A power cut must not bring a result back without its configuration.
            let synced = with_disk(|disk| disk.sync_folder(&self.folder));
            synced.map_err(io_error("sync", &self.folder))?;
        }
        unused.iter().try_for_each(|sha256| self.configurations.remove(sha256))
    }

    /// Returns the paths of the results, in ascending order of their numbers.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub(super) fn result_files(&self) -> Result<Vec<PathBuf>, StoreError> {
        let numbers = self.result_numbers()?;
        Ok(numbers.into_iter().map(|number| self.folder.join(name(number))).collect())
    }

    /// Returns the numbers of the results in the folder, in ascending order.
    fn result_numbers(&self) -> Result<Vec<u64>, StoreError> {
        let entries =
            fs::read_dir(&self.folder).map_err(io_error("read the folder", &self.folder))?;
        let mut indices = Vec::new();
        for entry in entries {
            let entry = entry.map_err(io_error("read the folder", &self.folder))?;
            indices.extend(entry.file_name().to_str().and_then(index));
        }
        indices.sort_unstable();
        Ok(indices)
    }
}

/// A result on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// Number in the file name.
    pub number: u64,
    /// Path of the file.
    pub path: PathBuf,
    /// Content of the file.
    pub json: Vec<u8>,
    /// History line of the result.
    pub line: HistoryLine,
}

/// The configuration hash in a result file.
#[derive(serde::Deserialize)]
struct ConfigurationReference {
    configuration: String,
}

/// Returns the path of a result file in a folder.
pub fn result_file(folder: &Path, number: u64) -> PathBuf {
    folder.join(name(number))
}

/// Returns the number of a result file by its name.
pub fn number_of_result(file: &Path) -> Option<u64> {
    index(file.file_name()?.to_str()?)
}

fn name(index: u64) -> String {
    format!("result-{index:08}.json")
}

fn report_name(index: u64) -> String {
    format!("result-{index:08}.html")
}

fn index(name: &str) -> Option<u64> {
    let index = name.strip_prefix("result-")?.strip_suffix(".json")?.parse().ok()?;
    // `result-42.json` and `result-+5.json` are not files of this program. `u64::MAX` is excluded,
    // because no number follows it.
    (self::name(index) == name && index < u64::MAX).then_some(index)
}

#[cfg(test)]
mod tests;
