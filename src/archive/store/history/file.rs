//! The history file. Lines are appended and synced, the size is bounded, and incomplete lines are
//! skipped.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::line::{HISTORY_SCHEMA, HistoryLine};
use crate::archive::store::error::{StoreError, io_error, write};
use crate::files::remove_leftovers;

pub(super) const FILE_NAME: &str = "history.jsonl";
/// Maximum length of a line \[bytes\]. A line with 1,000 parameters and a note has a tenth of it.
pub(super) const MAX_LINE: u64 = 1 << 20;

/// Error when reading a history.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// There is no history. The service writes one with its first result. If a service has run,
    /// name its folder.
    #[error(
        "no history in {}: the service writes one with its first result; name its folder with \
         --state, or its cell file with --cell",
        folder.display()
    )]
    None {
        /// The folder.
        folder: PathBuf,
    },
    /// The file system refused access. Check the permissions of the file.
    #[error("cannot read {}: {cause}; check its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
}

/// Reads the history of a results folder, oldest line first. Also returns the number of skipped
/// lines: incomplete lines, lines of other programs, and lines of a later version of this program.
///
/// # Errors
/// [`HistoryError`].
pub fn read_history(folder: &Path) -> Result<(Vec<HistoryLine>, usize), HistoryError> {
    let path = folder.join(FILE_NAME);
    let file = File::open(&path).map_err(|cause| match cause.kind() {
        io::ErrorKind::NotFound => HistoryError::None { folder: folder.to_owned() },
        _ => HistoryError::Io { path: path.clone(), cause },
    })?;
    let mut lines = Vec::new();
    let scanned = scan(file, |_, line| lines.extend(line));
    let scan = scanned.map_err(|cause| HistoryError::Io { path, cause })?;
    Ok((lines, scan.passed_over))
}

/// Content of a history file.
#[derive(Debug, Default)]
struct HistoryContent {
    /// Number of bytes up to the end of the last complete line.
    complete_bytes: u64,
    /// Length of the file \[bytes\].
    length: u64,
    /// Number of complete lines of this program, including those of a later version.
    lines: usize,
    /// Number of unreadable lines, including those of a later version.
    passed_over: usize,
    /// Result number of the last line of this program, if the line contains it.
    last_result: Option<u64>,
}

/// Fields that exist in every version of a line.
#[derive(Deserialize)]
struct VersionFields {
    schema: u32,
    #[serde(default)]
    result: Option<u64>,
}

/// Parses a line of this program: its result number and its content. The content is `None` if a
/// later version wrote the line. An older program, installed again, cannot read such a line and
/// keeps it.
pub(super) fn parse_line(text: &[u8]) -> Option<(Option<u64>, Option<HistoryLine>)> {
    let line: Option<HistoryLine> = serde_json::from_slice(text).ok();
    let VersionFields { schema, result } = match &line {
        Some(line) => VersionFields { schema: line.schema, result: Some(line.result) },
        None => serde_json::from_slice(text).ok()?,
    };
    match schema {
        HISTORY_SCHEMA => line.map(|line| (result, Some(line))),
        later if later > HISTORY_SCHEMA => Some((result, None)),
        _ => None,
    }
}

/// Calls a function with the bytes of every line of this program. The function also gets the parsed
/// line, unless a later version wrote it.
fn scan(
    file: File,
    mut take: impl FnMut(&[u8], Option<HistoryLine>),
) -> io::Result<HistoryContent> {
    let mut reader = BufReader::new(file);
    let (mut scan, mut line) = (HistoryContent::default(), Vec::new());
    loop {
        line.clear();
        // A longer line is read in pieces. No piece is a valid line.
        let read = (&mut reader).take(MAX_LINE).read_until(b'\n', &mut line)?;
        if read == 0 {
            return Ok(scan);
        }
        scan.length += read as u64;
        let is_complete = line.ends_with(b"\n");
        if is_complete {
            scan.complete_bytes = scan.length;
        }
        match parse_line(&line).filter(|_| is_complete) {
            Some((result, context)) => {
                scan.lines += 1;
                scan.last_result = result;
                scan.passed_over += usize::from(context.is_none());
                take(&line, context);
            }
            None => scan.passed_over += 1,
        }
    }
}

/// The history file, opened by its only writer.
#[derive(Debug)]
pub(in crate::archive::store) struct HistoryFile {
    folder: PathBuf,
    path: PathBuf,
    /// Number of bytes of the complete lines. Later bytes in the file are from a failed append.
    length: u64,
    lines: usize,
    /// Result number of the last line when the file was opened.
    last_result: Option<u64>,
    /// Maximum number of lines.
    max_lines: usize,
}

impl HistoryFile {
    /// Opens the history of a folder, in which `keep` lines are kept, and returns the last `recent`
    /// lines. Removes an incomplete last line, because nothing may be appended to it.
    pub(in crate::archive::store) fn open(
        folder: &Path,
        keep: usize,
        recent: usize,
    ) -> Result<(Self, VecDeque<HistoryLine>), StoreError> {
        let path = folder.join(FILE_NAME);
        remove_leftovers(folder, |name| name == FILE_NAME)
            .map_err(io_error("clean up the folder", folder))?;
        let mut last = VecDeque::new();
        let scan = match File::open(&path) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => HistoryContent::default(),
            opened => {
                let scanned = opened.and_then(|file| {
                    scan(file, |_, line| {
                        last.extend(line);
                        if last.len() > recent {
                            last.pop_front();
                        }
                    })
                });
                scanned.map_err(io_error("read", &path))?
            }
        };
        if scan.passed_over > 0 {
            tracing::warn!(
                "{}: lines skipped as incomplete, unknown or of a later version: {}",
                path.display(),
                scan.passed_over
            );
        }
        let history = Self {
            folder: folder.to_owned(),
            path,
            length: scan.complete_bytes,
            lines: scan.lines,
            last_result: scan.last_result,
            max_lines: keep.max(1),
        };
        if scan.complete_bytes < scan.length {
            history.cut_tail()?;
        }
        Ok((history, last))
    }

    /// Appends a line and syncs it. Removes the oldest lines when the file has a tenth more lines
    /// than are to be kept. The removal rewrites the complete file, and is therefore not done with
    /// each result. A failure of the removal is only logged, because the line is stored already.
    pub(in crate::archive::store) fn append(
        &mut self,
        line: &HistoryLine,
    ) -> Result<(), StoreError> {
        let mut json = serde_json::to_vec(line)?;
        json.push(b'\n');
        let is_new = !self.path.exists();
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .map_err(io_error("open", &self.path))?;
        let length = file.metadata().map_err(io_error("read", &self.path))?.len();
        if length != self.length {
            self.look_again(length)?;
        }
        let written = file.write_all(&json).and_then(|()| file.sync_data());
        if let Err(cause) = written {
            // Restores the previous state. If this fails as well, the next append repairs the file.
            let _ = self.cut_tail();
            return Err(io_error("append to", &self.path)(cause));
        }
        self.length += json.len() as u64;
        self.lines += 1;
        let synced = if is_new { self.sync_folder() } else { Ok(()) };
        let many = self.lines > self.max_lines + self.max_lines / 10;
        let tidied = if many { self.remove_oldest() } else { Ok(()) };
        for problem in [synced.err(), tidied.err()].into_iter().flatten() {
            tracing::warn!("the history has the new line, but: {problem}");
        }
        Ok(())
    }

    /// Returns the number after that of the last line when the file was opened.
    pub(in crate::archive::store) fn next_result(&self) -> u64 {
        self.last_result.map_or(0, |last| last.saturating_add(1))
    }

    /// Returns true if the opened history had no line of this result: the number is greater than
    /// that of the last line, or there are no lines. Returns false if the last line has no result
    /// number.
    pub(in crate::archive::store) fn is_missing(&self, result: u64) -> bool {
        self.last_result.map_or(self.lines == 0, |last| result > last)
    }

    /// Reads the file again after another program has changed, replaced or removed it. Keeps all
    /// complete lines. Removes only the bytes after the last newline, usually half a line of a
    /// failed append.
    fn look_again(&mut self, there: u64) -> Result<(), StoreError> {
        let file = File::open(&self.path).map_err(io_error("open", &self.path))?;
        let scan = scan(file, |_, _| {}).map_err(io_error("read", &self.path))?;
        (self.length, self.lines) = (scan.complete_bytes, scan.lines);
        if there > scan.complete_bytes { self.cut_tail() } else { Ok(()) }
    }

    fn cut_tail(&self) -> Result<(), StoreError> {
        let file = OpenOptions::new().write(true).open(&self.path);
        let cut = file.and_then(|file| file.set_len(self.length).and_then(|()| file.sync_all()));
        cut.map_err(io_error("remove an incomplete line from", &self.path))
    }

    /// Rewrites the file with the newest lines, which are copied unchanged.
    fn remove_oldest(&mut self) -> Result<(), StoreError> {
        let mut lines_kept = VecDeque::new();
        let file = File::open(&self.path).map_err(io_error("read", &self.path))?;
        let scanned = scan(file, |text, _| {
            lines_kept.push_back(text.to_vec());
            if lines_kept.len() > self.max_lines {
                lines_kept.pop_front();
            }
        });
        scanned.map_err(io_error("read", &self.path))?;
        let content = lines_kept.iter().flatten().copied().collect::<Vec<u8>>();
        write(&self.path, &content)?;
        self.length = content.len() as u64;
        self.lines = lines_kept.len();
        Ok(())
    }

    fn sync_folder(&self) -> Result<(), StoreError> {
        let synced = File::open(&self.folder).and_then(|folder| folder.sync_all());
        synced.map_err(io_error("sync", &self.folder))
    }
}
