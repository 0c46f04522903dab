//! The file of the history: appended to, synced, bounded; a line that was torn is passed over.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::line::{HISTORY_SCHEMA, HistoryLine};
use crate::archive::store::error::{StoreError, at, write};
use crate::files::remove_leftovers;

pub(super) const NAME: &str = "history.jsonl";
/// The longest line \[bytes\]: 1,000 parameters and a note take a tenth of it.
pub(super) const MAX_LINE: u64 = 1 << 20;

/// Why a history cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// There is none. The service writes one with its first result; or name another folder.
    #[error(
        "no history in {}: the service writes one with its first result; name its folder with \
         --state, or its cell file with --cell",
        folder.display()
    )]
    None {
        /// The folder.
        folder: PathBuf,
    },
    /// The file system refused. Check the permissions of the file.
    #[error("cannot read {}: {cause}; check its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
}

/// Reads the history of a folder of results, oldest line first, with the number of lines that were
/// passed over because they are torn, none of ours, or of a later version of this program.
///
/// # Errors
/// [`HistoryError`].
pub fn read_history(folder: &Path) -> Result<(Vec<HistoryLine>, usize), HistoryError> {
    let path = folder.join(NAME);
    let file = File::open(&path).map_err(|cause| match cause.kind() {
        io::ErrorKind::NotFound => HistoryError::None { folder: folder.to_owned() },
        _ => HistoryError::Io { path: path.clone(), cause },
    })?;
    let mut lines = Vec::new();
    let scanned = scan(file, |_, line| lines.extend(line));
    let scan = scanned.map_err(|cause| HistoryError::Io { path, cause })?;
    Ok((lines, scan.passed_over))
}

/// What there is in a file.
#[derive(Debug, Default)]
struct Scan {
    /// Bytes up to the end of the last whole line.
    whole: u64,
    /// Bytes of all.
    length: u64,
    /// Lines to count and to keep: whole ones of ours, those of a later version among them.
    lines: usize,
    /// Lines that could not be read, those of a later version among them.
    passed_over: usize,
    /// The number of the result of the last line of ours, where that says so.
    last_result: Option<u64>,
}

/// What every version of a line has.
#[derive(Deserialize)]
struct Version {
    schema: u32,
    #[serde(default)]
    result: Option<u64>,
}

/// A line of ours, its result's number and itself: as it is read, or nothing when a later version wrote it. An older program, put back
/// into its place, does not understand such a line, and keeps it for the newer one.
pub(super) fn understand(text: &[u8]) -> Option<(Option<u64>, Option<HistoryLine>)> {
    let line: Option<HistoryLine> = serde_json::from_slice(text).ok();
    let Version { schema, result } = match &line {
        Some(line) => Version { schema: line.schema, result: Some(line.result) },
        None => serde_json::from_slice(text).ok()?,
    };
    match schema {
        HISTORY_SCHEMA => line.map(|line| (result, Some(line))),
        later if later > HISTORY_SCHEMA => Some((result, None)),
        _ => None,
    }
}

/// Gives every line of ours as its bytes, and read unless a later version wrote it.
fn scan(file: File, mut take: impl FnMut(&[u8], Option<HistoryLine>)) -> io::Result<Scan> {
    let mut reader = BufReader::new(file);
    let (mut scan, mut line) = (Scan::default(), Vec::new());
    loop {
        line.clear();
        // What is longer is read in pieces, none of which is a line of ours.
        let read = (&mut reader).take(MAX_LINE).read_until(b'\n', &mut line)?;
        if read == 0 {
            return Ok(scan);
        }
        scan.length += read as u64;
        let whole = line.ends_with(b"\n");
        if whole {
            scan.whole = scan.length;
        }
        match understand(&line).filter(|_| whole) {
            Some((result, known)) => {
                scan.lines += 1;
                scan.last_result = result;
                scan.passed_over += usize::from(known.is_none());
                take(&line, known);
            }
            None => scan.passed_over += 1,
        }
    }
}

/// The history as its only writer sees it.
#[derive(Debug)]
pub(in crate::archive::store) struct HistoryFile {
    folder: PathBuf,
    path: PathBuf,
    /// Bytes of the whole lines: what is behind them is an append that failed.
    length: u64,
    lines: usize,
    /// As in the file when it was opened.
    last_result: Option<u64>,
    /// Lines to keep.
    keep: usize,
}

impl HistoryFile {
    /// Opens the history of a folder, of which `keep` lines are to be kept, and gives the last
    /// `recent` of them. A torn last line is cut off: nothing may be appended to it.
    pub(in crate::archive::store) fn open(
        folder: &Path,
        keep: usize,
        recent: usize,
    ) -> Result<(Self, VecDeque<HistoryLine>), StoreError> {
        let path = folder.join(NAME);
        remove_leftovers(folder, |name| name == NAME).map_err(at("clean up the folder", folder))?;
        let mut last = VecDeque::new();
        let scan = match File::open(&path) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Scan::default(),
            opened => {
                let scanned = opened.and_then(|file| {
                    scan(file, |_, line| {
                        last.extend(line);
                        if last.len() > recent {
                            last.pop_front();
                        }
                    })
                });
                scanned.map_err(at("read", &path))?
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
            length: scan.whole,
            lines: scan.lines,
            last_result: scan.last_result,
            keep: keep.max(1),
        };
        if scan.whole < scan.length {
            history.cut_off()?;
        }
        Ok((history, last))
    }

    /// Appends a line and syncs it. When it is a tenth more than the lines to keep, the oldest are
    /// removed: not with each result, for that writes the whole file. A failure of that is only
    /// logged, for the line is there.
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
            .map_err(at("open", &self.path))?;
        let there = file.metadata().map_err(at("read", &self.path))?.len();
        if there != self.length {
            self.look_again(there)?;
        }
        let written = file.write_all(&json).and_then(|()| file.sync_data());
        if let Err(cause) = written {
            // As if nothing had been tried; if that fails as well, the next append sees to it.
            let _ = self.cut_off();
            return Err(at("append to", &self.path)(cause));
        }
        self.length += json.len() as u64;
        self.lines += 1;
        let synced = if is_new { self.sync_folder() } else { Ok(()) };
        let many = self.lines > self.keep + self.keep / 10;
        let tidied = if many { self.remove_oldest() } else { Ok(()) };
        for problem in [synced.err(), tidied.err()].into_iter().flatten() {
            tracing::warn!("the history has the new line, but: {problem}");
        }
        Ok(())
    }

    /// Whether a result with this number came after the last line, when the file was opened. Of lines
    /// that do not say whose they are nothing is known.
    pub(in crate::archive::store) fn lacks(&self, result: u64) -> bool {
        self.last_result.map_or(self.lines == 0, |last| result > last)
    }

    /// Finds the end of a file that is not as this writer left it. Somebody else put lines into it,
    /// copied another one to its place, cut or removed it: whatever lines it has now stay. Only what
    /// follows the last newline is cut off: the half of a line, of an append that failed as a rule.
    fn look_again(&mut self, there: u64) -> Result<(), StoreError> {
        let file = File::open(&self.path).map_err(at("open", &self.path))?;
        let scan = scan(file, |_, _| {}).map_err(at("read", &self.path))?;
        (self.length, self.lines) = (scan.whole, scan.lines);
        if there > scan.whole { self.cut_off() } else { Ok(()) }
    }

    fn cut_off(&self) -> Result<(), StoreError> {
        let file = OpenOptions::new().write(true).open(&self.path);
        let cut = file.and_then(|file| file.set_len(self.length).and_then(|()| file.sync_all()));
        cut.map_err(at("remove an incomplete line from", &self.path))
    }

    /// Writes the lines to keep in the place of the file, as they are.
    fn remove_oldest(&mut self) -> Result<(), StoreError> {
        let mut kept = VecDeque::new();
        let file = File::open(&self.path).map_err(at("read", &self.path))?;
        let scanned = scan(file, |text, _| {
            kept.push_back(text.to_vec());
            if kept.len() > self.keep {
                kept.pop_front();
            }
        });
        scanned.map_err(at("read", &self.path))?;
        let content = kept.iter().flatten().copied().collect::<Vec<u8>>();
        write(&self.path, &content)?;
        self.length = content.len() as u64;
        self.lines = kept.len();
        Ok(())
    }

    fn sync_folder(&self) -> Result<(), StoreError> {
        let synced = File::open(&self.folder).and_then(|folder| folder.sync_all());
        synced.map_err(at("sync", &self.folder))
    }
}
