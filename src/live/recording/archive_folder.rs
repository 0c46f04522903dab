//! The folder of the kept recordings: their names, number and size.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::options::archive_folder;
use super::ring::{RingError, io_error};
use crate::files::remove_leftovers;

/// Reason for keeping a recording. The file name begins with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Result,
    Fault,
    Capture,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Result => "result",
            Self::Fault => "fault",
            Self::Capture => "capture",
        }
    }
}

const KINDS: [Kind; 3] = [Kind::Result, Kind::Fault, Kind::Capture];
const FILE_SUFFIX: &str = ".mcap";

/// Returns the path of the recording of a result, if it is kept in the folder of all recordings.
pub fn kept_result(recordings: &Path, number: u64) -> Option<PathBuf> {
    let name = format!("{}-{number:08}{FILE_SUFFIX}", Kind::Result.name());
    Some(archive_folder(recordings).join(name)).filter(|path| path.is_file())
}

#[derive(Clone, Debug)]
struct ArchiveFile {
    kind: Kind,
    number: u64,
    path: PathBuf,
    bytes: u64,
    modified: SystemTime,
}

/// A folder of recordings. The oldest recordings are removed to keep its limits. Files with other
/// names are not changed.
#[derive(Debug)]
pub(super) struct ArchiveFolder {
    folder: PathBuf,
    /// Maximum number of recordings of each kind.
    max_per_kind: usize,
    /// Maximum total size \[bytes\].
    max_bytes: u64,
}

impl ArchiveFolder {
    pub(super) fn open(folder: &Path, keep: usize, keep_bytes: u64) -> Result<Self, RingError> {
        fs::create_dir_all(folder).map_err(io_error("make the folder", folder))?;
        let archive =
            Self { folder: folder.to_owned(), max_per_kind: keep.max(1), max_bytes: keep_bytes };
        // Incomplete files that a killed process has left behind.
        remove_leftovers(folder, |name| parse(name).is_some())
            .map_err(io_error("clean up the folder", folder))?;
        Ok(archive)
    }

    /// Removes the oldest recordings until `bytes` more fit. Returns false if they cannot fit.
    pub(super) fn make_room(&self, bytes: u64) -> Result<bool, RingError> {
        if bytes > self.max_bytes {
            return Ok(false);
        }
        let mut files = self.files()?;
        files.sort_by_key(|file| (file.modified, file.number));
        let mut total: u64 = files.iter().map(|file| file.bytes).sum();
        for file in files {
            if total.saturating_add(bytes) <= self.max_bytes {
                break;
            }
            fs::remove_file(&file.path).map_err(io_error("remove", &file.path))?;
            total = total.saturating_sub(file.bytes);
        }
        Ok(true)
    }

    /// Returns the path of a recording.
    pub(super) fn path(&self, kind: Kind, number: u64, label: &str) -> PathBuf {
        let label = if label.is_empty() { String::new() } else { format!("-{label}") };
        self.folder.join(format!("{}-{number:08}{label}{FILE_SUFFIX}", kind.name()))
    }

    /// Removes the oldest recordings of a kind beyond the number to keep.
    pub(super) fn prune(&self, kind: Kind) -> Result<(), RingError> {
        let mut files = self.files()?;
        files.retain(|file| file.kind == kind);
        files.sort_by_key(|file| (file.number, file.modified));
        let surplus = files.len().saturating_sub(self.max_per_kind);
        for file in files.into_iter().take(surplus) {
            fs::remove_file(&file.path).map_err(io_error("remove", &file.path))?;
        }
        Ok(())
    }

    /// Returns a number that no recording of this kind has had before.
    pub(super) fn next(&self, kind: Kind) -> Result<u64, RingError> {
        let files = self.files()?;
        let numbers = files.iter().filter(|file| file.kind == kind).map(|file| file.number);
        Ok(numbers.max().map_or(0, |last| last.saturating_add(1)))
    }

    /// Returns number and total size of the recordings \[bytes\].
    pub(super) fn total_size(&self) -> Result<(usize, u64), RingError> {
        let files = self.files()?;
        Ok((files.len(), files.iter().map(|file| file.bytes).sum()))
    }

    fn files(&self) -> Result<Vec<ArchiveFile>, RingError> {
        let entries =
            fs::read_dir(&self.folder).map_err(io_error("read the folder", &self.folder))?;
        let mut files = Vec::new();
        for entry in entries {
            let entry = entry.map_err(io_error("read the folder", &self.folder))?;
            let Some((kind, number)) = entry.file_name().to_str().and_then(parse) else { continue };
            let Ok(metadata) = entry.metadata() else { continue };
            let modified = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let (path, bytes) = (entry.path(), metadata.len());
            files.push(ArchiveFile { kind, number, path, bytes, modified });
        }
        Ok(files)
    }
}

/// Parses kind and number from a recording's file name.
fn parse(name: &str) -> Option<(Kind, u64)> {
    let stem = name.strip_suffix(FILE_SUFFIX)?;
    let (kind, rest) = stem.split_once('-')?;
    let kind = KINDS.into_iter().find(|candidate| candidate.name() == kind)?;
    let digits = rest.split('-').next()?;
    let number = digits.parse().ok().filter(|number| format!("{number:08}") == digits)?;
    Some((kind, number))
}
