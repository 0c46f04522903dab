//! Results on disk: whole or not at all, a bounded number, with what is needed to make them again.

mod configurations;
mod history;
mod record;
mod samples;
mod timestamp;

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, flock};

pub use configurations::ConfigurationTexts;
use configurations::Configurations;
pub use history::{HISTORY_SCHEMA, HistoryError, HistoryLine, ParameterValue, read_history};
use history::{HistoryFile, TREND_LINES};
pub use record::{ResultRecord, WindowProvenance};
pub use samples::input_sha256;
pub use timestamp::Timestamp;

/// Results kept unless the cell says otherwise.
pub const DEFAULT_KEEP: usize = 1000;

const LATEST: &str = "latest.json";
const TEMPORARY: &str = ".writing.tmp";

/// A folder of results, `result-00000000.json` and on, each with its report of the same number
/// (`.html`), `latest.json`, a copy of the newest, and `history.jsonl`, a line per result with its
/// date. `configurations` has a folder for each configuration that a result was made with.
///
/// One process writes into it at a time: it is locked as long as this lives. The number in a name
/// continues over restarts, so that no result is overwritten. Files with other names are let be.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// The folder itself, locked.
    locked: File,
    keep: usize,
    next: u64,
    history: HistoryFile,
    configurations: Configurations,
}

/// Lines of the history that a process has at hand: as many as are kept where fewer results are, so
/// that it knows the alarms that `didim history` finds in the file. Some kilobytes each.
pub(crate) const RECENT_LINES: usize = TREND_LINES;

/// Why a result is not on disk.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused. Check the rights on the folder and the space left.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// The system's word.
        cause: io::Error,
    },
    /// Another process writes its results there: end it, or name another folder.
    #[error(
        "{} is in use by another process; end it, or choose another folder for the results",
        folder.display()
    )]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// The record has no JSON form. A mistake of this program.
    #[error("the result has no JSON form: {0}")]
    Format(#[from] serde_json::Error),
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
        let (history, recent) = HistoryFile::open(folder, lines, RECENT_LINES)?;
        let mut store = Self {
            folder: folder.to_owned(),
            locked,
            keep: keep.max(1),
            next: 0,
            history,
            configurations: Configurations::beside_results(folder),
        };
        store.configurations.clear_unfinished()?;
        // What a process was writing when it died.
        match fs::remove_file(store.folder.join(TEMPORARY)) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                return Err(at("remove", &store.folder.join(TEMPORARY))(cause));
            }
            _ => {}
        }
        store.next = store.indices()?.last().map_or(0, |last| last.saturating_add(1));
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

    /// Appends a result to the history.
    ///
    /// # Errors
    /// [`StoreError::Io`]; the lines of before are untouched.
    pub fn remember(&mut self, line: &HistoryLine) -> Result<(), StoreError> {
        self.history.append(line)
    }

    /// Writes a result: into a temporary file, to the disk, and only then under its name. Then
    /// writes its report, renews the copy and removes the oldest beyond the number to keep; a
    /// failure of these is only logged, for the result is there.
    ///
    /// # Errors
    /// [`StoreError`]; what was there before is untouched.
    pub fn write(
        &mut self,
        record: &ResultRecord<'_>,
        report: Option<&str>,
    ) -> Result<Stored, StoreError> {
        let mut json = serde_json::to_vec_pretty(record)?;
        json.push(b'\n');
        let number = self.next;
        let path = self.folder.join(name(number));
        self.replace(&path, &json)?;
        let beside = report.map_or(Ok(()), |report| {
            self.replace(&self.folder.join(report_name(self.next)), report.as_bytes())
        });
        let number = self.next;
        self.next = self.next.saturating_add(1);
        let tidied = self
            .sync_folder()
            .and_then(|()| self.replace(&self.folder.join(LATEST), &json))
            .and_then(|()| self.sync_folder());
        let pruned = self.prune(record.configuration);
        for problem in [beside.err(), tidied.err(), pruned.err()].into_iter().flatten() {
            tracing::warn!("{} is stored, but: {problem}", path.display());
        }
        Ok(Stored { number, path, json })
    }

    /// Write, sync, rename: after a power cut the name has the old content or the new one (rename(2),
    /// fsync(2)).
    fn replace(&self, path: &Path, content: &[u8]) -> Result<(), StoreError> {
        let temporary = self.folder.join(TEMPORARY);
        let mut file = File::create(&temporary).map_err(at("create", &temporary))?;
        file.write_all(content).and_then(|()| file.sync_all()).map_err(at("write", &temporary))?;
        drop(file);
        fs::rename(&temporary, path).map_err(at("rename a result to", path))
    }

    /// Makes the new names outlast a power cut.
    fn sync_folder(&self) -> Result<(), StoreError> {
        self.locked.sync_all().map_err(at("sync", &self.folder))
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

/// Of a result's file, what its configuration is.
#[derive(serde::Deserialize)]
struct Referring {
    configuration: String,
}

/// A result that is on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored {
    /// The number in its name.
    pub number: u64,
    /// Where.
    pub path: PathBuf,
    /// Its content.
    pub json: Vec<u8>,
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

fn at(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.to_owned();
    move |cause| StoreError::Io { action, path, cause }
}

#[cfg(test)]
mod tests;
