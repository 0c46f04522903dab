//! The folder of the results.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, flock};

use super::configurations::{ConfigurationTexts, Configurations};
use super::error::{StoreError, at, write};
use super::history::{HistoryFile, HistoryLine, TREND_LINES};
use super::owed::{Owed, line_of};
use super::record::{Beside, ResultRecord};
use super::timestamp::Timestamp;
use crate::files::remove_leftovers;

/// Results kept unless the cell says otherwise.
pub const DEFAULT_KEEP: usize = 1000;

/// Lines of the history that a process has at hand: as many as are kept where fewer results are, so
/// that it knows the alarms that `didim history` finds in the file. Some kilobytes each.
pub(crate) const RECENT_LINES: usize = TREND_LINES;

const LATEST: &str = "latest.json";

/// A folder of results, `result-00000000.json` and on, each with its report of the same number
/// (`.html`), `latest.json`, a copy of the newest, and `history.jsonl`, a line per result with its
/// date. `configurations` has a folder for each configuration that a result was made with.
///
/// One process writes into it at a time: it is locked as long as this lives. The number in a name
/// continues over restarts, so that no result is overwritten. Files with other names stay.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// The folder itself, locked.
    _locked: File,
    keep: usize,
    next: u64,
    history: HistoryFile,
    /// Lines of stored results that are not in the history yet.
    owed: Owed,
    /// Why they are not.
    refused: Option<String>,
    configurations: Configurations,
}

impl Store {
    /// Opens the folder, making it if need be, and keeps at most `keep` results (at least one).
    ///
    /// # Errors
    /// [`StoreError::Io`] and [`StoreError::InUse`].
    pub fn open(folder: &Path, keep: usize) -> Result<Self, StoreError> {
        Self::open_with_history(folder, keep).map(|(store, _)| store)
    }

    /// As [`Self::open`], with the last lines of the history.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_with_history(
        folder: &Path,
        keep: usize,
    ) -> Result<(Self, VecDeque<HistoryLine>), StoreError> {
        fs::create_dir_all(folder).map_err(at("make the folder", folder))?;
        let locked = File::open(folder).map_err(at("open the folder", folder))?;
        // flock(2): the lock is of the opened folder and goes with the process, however it ends.
        flock(&locked, FlockOperation::NonBlockingLockExclusive).map_err(|error| match error {
            rustix::io::Errno::WOULDBLOCK => StoreError::InUse { folder: folder.to_owned() },
            other => at("lock the folder", folder)(other.into()),
        })?;
        let lines = keep.max(TREND_LINES);
        let (history, mut recent) = HistoryFile::open(folder, lines, RECENT_LINES)?;
        let mut store = Self {
            folder: folder.to_owned(),
            _locked: locked,
            keep: keep.max(1),
            next: 0,
            history,
            owed: Owed::of(folder),
            refused: None,
            configurations: Configurations::beside_results(folder),
        };
        store.configurations.clear_unfinished()?;
        // What a process was writing when it died.
        let is_ours = |name: &str| {
            let report = name.strip_suffix(".html").map(|stem| format!("{stem}.json"));
            name == LATEST
                || Owed::is_name(name)
                || index(report.as_deref().unwrap_or(name)).is_some()
        };
        remove_leftovers(folder, is_ours).map_err(at("clean up the folder", folder))?;
        let indices = store.indices()?;
        store.next = indices.last().map_or(0, |last| last.saturating_add(1));
        store.complete(&indices, &mut recent)?;
        Ok((store, recent))
    }

    /// Keeps the texts of a configuration for the results that refer to its hash.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn keep_configuration(
        &self,
        sha256: &str,
        texts: &ConfigurationTexts,
    ) -> Result<(), StoreError> {
        self.configurations.keep(sha256, texts)
    }

    /// Writes a result, and its line of the history, which is on disk before it: whoever is killed
    /// from then on loses neither. Then writes its report, renews the copy and removes the oldest
    /// beyond the number to keep; a failure of these is only logged, for the result is there, and a
    /// line that cannot be appended yet is tried again with the next one and at the next start.
    ///
    /// # Errors
    /// [`StoreError`]; what was there before is untouched.
    pub fn write(
        &mut self,
        record: &ResultRecord,
        beside: &Beside,
        now: Timestamp,
    ) -> Result<Stored, StoreError> {
        let mut json = serde_json::to_vec_pretty(record)?;
        json.push(b'\n');
        let number = self.next;
        let path = self.folder.join(name(number));
        let line = HistoryLine::of(number, record, beside, now);
        self.owed.add(line.clone());
        let written = self.owed.write().and_then(|()| write(&path, &json));
        if let Err(error) = written {
            self.owed.take_back();
            return Err(error);
        }
        self.next = self.next.saturating_add(1);
        let remembered = self.settle();
        let report = beside.report.as_ref().map_or(Ok(()), |report| {
            write(&self.folder.join(report_name(number)), report.as_bytes())
        });
        let copied = write(&self.folder.join(LATEST), &json);
        let pruned = self.prune(&record.configuration);
        for problem in [remembered, report, copied, pruned].into_iter().filter_map(Result::err) {
            tracing::warn!("{} is stored, but: {problem}", path.display());
        }
        Ok(Stored { number, path, json, line })
    }

    /// Finishes what a process had begun that was killed, or whose disk was full, when it had stored a
    /// result and not yet its line of the history. Without the line that was put aside for it, one is
    /// made of the result.
    fn complete(
        &mut self,
        indices: &[u64],
        recent: &mut VecDeque<HistoryLine>,
    ) -> Result<(), StoreError> {
        for line in self.owed.read() {
            let known =
                |other: &HistoryLine| (other.result, other.time) == (line.result, line.time);
            if indices.contains(&line.result) && !recent.iter().any(known) {
                self.owed.add(line);
            }
        }
        for number in indices.iter().copied().filter(|number| self.history.lacks(*number)) {
            if self.owed.has(number) {
                continue;
            }
            let path = self.folder.join(name(number));
            match line_of(&path, number, recent) {
                Some(line) => self.owed.add(line),
                None => {
                    tracing::warn!("{}: it cannot be added to the history", path.display())
                }
            }
        }
        if self.owed.is_empty() {
            return self.owed.forget();
        }
        if let Some(newest) = indices.last() {
            let path = self.folder.join(name(*newest));
            let copied = fs::read(&path).map_err(at("read", &path));
            let copied = copied.and_then(|json| write(&self.folder.join(LATEST), &json));
            if let Err(problem) = copied {
                tracing::warn!("{problem}");
            }
        }
        tracing::warn!(
            "{}: history lines that an earlier run did not write: {}",
            self.folder.display(),
            self.owed.lines().len()
        );
        recent.extend(self.owed.lines().cloned());
        while recent.len() > RECENT_LINES {
            recent.pop_front();
        }
        self.owed.write()?;
        if let Err(problem) = self.settle() {
            tracing::warn!("they are not written yet: {problem}");
        }
        Ok(())
    }

    /// Appends the lines that the history lacks.
    ///
    /// # Errors
    /// [`StoreError::Io`]; they are tried again.
    pub fn settle(&mut self) -> Result<(), StoreError> {
        let settled = self.owed.settle(&mut self.history);
        self.refused = settled.as_ref().err().map(ToString::to_string);
        settled
    }

    /// How many lines the history lacks, and why it does.
    pub fn owed(&self) -> (usize, Option<&str>) {
        (self.owed.lines().len(), self.refused.as_deref())
    }

    /// Removes every result beyond the number to keep that can be removed, each with its report, and
    /// the configurations to which no other result refers.
    fn prune(&self, current: &str) -> Result<(), StoreError> {
        let indices = self.indices()?;
        let surplus = indices.len().saturating_sub(self.keep);
        let mut removed = Ok(());
        for index in indices.into_iter().take(surplus) {
            // The report first: without its result nobody would remove it.
            let report = self.folder.join(report_name(index));
            removed = removed.and(match fs::remove_file(&report) {
                Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                    Err(at("remove", &report)(cause))
                }
                _ => Ok(()),
            });
            let path = self.folder.join(name(index));
            removed = removed.and(fs::remove_file(&path).map_err(at("remove", &path)));
        }
        removed.and_then(|()| if surplus > 0 { self.prune_configurations(current) } else { Ok(()) })
    }

    /// Removes every configuration that is not the current one and to which no result refers.
    /// There is one as a rule, and then no result is read.
    fn prune_configurations(&self, current: &str) -> Result<(), StoreError> {
        let mut unused = self.configurations.kept()?;
        unused.retain(|sha256| sha256 != current);
        // Whatever was made with an older configuration is among the oldest results.
        for index in self.indices()? {
            if unused.is_empty() {
                return Ok(());
            }
            let path = self.folder.join(name(index));
            let content = fs::read(&path).map_err(at("read", &path))?;
            match serde_json::from_slice::<Referring>(&content) {
                Ok(result) => unused.retain(|sha256| *sha256 != result.configuration),
                // It may refer to any.
                Err(_) => return Ok(()),
            }
        }
        unused.iter().try_for_each(|sha256| self.configurations.remove(sha256))
    }

    /// The numbers of the results in the folder, in order.
    fn indices(&self) -> Result<Vec<u64>, StoreError> {
        let entries = fs::read_dir(&self.folder).map_err(at("read the folder", &self.folder))?;
        let mut indices = Vec::new();
        for entry in entries {
            let entry = entry.map_err(at("read the folder", &self.folder))?;
            indices.extend(entry.file_name().to_str().and_then(index));
        }
        indices.sort_unstable();
        Ok(indices)
    }
}

/// A result that is on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// The number in its name.
    pub number: u64,
    /// Where.
    pub path: PathBuf,
    /// Its content.
    pub json: Vec<u8>,
    /// Its line of the history.
    pub line: HistoryLine,
}

/// Of a result's file, what its configuration is.
#[derive(serde::Deserialize)]
struct Referring {
    configuration: String,
}

/// The file of a result in a folder.
pub fn result_file(folder: &Path, number: u64) -> PathBuf {
    folder.join(name(number))
}

fn name(index: u64) -> String {
    format!("result-{index:08}.json")
}

fn report_name(index: u64) -> String {
    format!("result-{index:08}.html")
}

fn index(name: &str) -> Option<u64> {
    let index = name.strip_prefix("result-")?.strip_suffix(".json")?.parse().ok()?;
    // `result-42.json` and `result-+5.json` are not ours; after the last number comes none.
    (self::name(index) == name && index < u64::MAX).then_some(index)
}

#[cfg(test)]
mod tests;
