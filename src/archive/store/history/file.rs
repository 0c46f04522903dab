//! The history on disk. Lines are appended and synced, the size is bounded, and incomplete lines
//! are skipped.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::days::{self, DaysFile, open_days};
use super::line::HistoryLine;
use super::scan::{HistoryContent, scan};
use super::segments::{is_segment, open_segment, segment_numbers, segment_path, write_segment};
use crate::archive::store::error::{StoreError, io_error, write};
use crate::archive::store::timestamp::Timestamp;
use crate::files::{remove_leftovers, replace, with_disk};

pub(super) const FILE_NAME: &str = "history.jsonl";

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
    /// A file is damaged. Without it, the other parts are read.
    #[error(
        "{} is damaged: no complete zstd file; restore it from a copy, or move it away",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
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

fn read_failure(path: &Path) -> impl FnOnce(io::Error) -> HistoryError {
    let path = path.to_owned();
    move |cause| match cause.raw_os_error() {
        // The decoder of compressed lines found no fault of the system.
        None => HistoryError::Damaged { path },
        Some(_) => HistoryError::Io { path, cause },
    }
}

/// Calls a function with each line of the history of a results folder, oldest first: the rows of
/// the days, then the lines of the results. Returns the number of skipped lines: incomplete lines,
/// lines of other programs, and lines of a later version of this program. Keeps no line in memory.
///
/// # Errors
/// [`HistoryError`].
pub fn for_each_line(
    folder: &Path,
    mut take: impl FnMut(HistoryLine),
) -> Result<usize, HistoryError> {
    let path = folder.join(FILE_NAME);
    let (segments, current) = open_parts(folder).map_err(read_failure(&path))?;
    if current.is_none() && segments.is_empty() {
        return Err(HistoryError::None { folder: folder.to_owned() });
    }
    for_each_day(folder, &mut take)?;
    let mut passed_over = 0;
    let mut take_all = |path: &Path, file: &mut dyn Read| {
        let scanned = scan(file, |_, line| line.into_iter().for_each(&mut take))?;
        scanned.skipped.warn(path);
        passed_over += scanned.skipped.count;
        io::Result::Ok(())
    };
    for number in segments {
        match open_segment(folder, number) {
            // The writer has replaced it by rows of days since.
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => {}
            opened => {
                let path = segment_path(folder, number);
                let taken = opened.and_then(|mut segment| take_all(&path, &mut segment));
                taken.map_err(read_failure(&path))?;
            }
        }
    }
    if let Some(mut current) = current {
        take_all(&path, &mut current).map_err(read_failure(&path))?;
    }
    Ok(passed_over)
}

/// Calls a function with the rows of the days of a results folder, oldest first.
///
/// # Errors
/// [`HistoryError::Io`].
pub fn for_each_day(folder: &Path, mut take: impl FnMut(HistoryLine)) -> Result<(), HistoryError> {
    let path = folder.join(days::FILE_NAME);
    let Some(file) = open_days(folder).map_err(read_failure(&path))? else { return Ok(()) };
    let scanned = scan(file, |_, line| line.into_iter().for_each(&mut take));
    scanned.map_err(read_failure(&path))?.skipped.warn(&path);
    Ok(())
}

/// Returns the numbers of the segments, and the opened file of the newest lines. Both belong
/// together although a writer may close the file meanwhile.
pub(super) fn open_parts(folder: &Path) -> io::Result<(Vec<u64>, Option<File>)> {
    loop {
        let segments = segment_numbers(folder)?;
        let current = match File::open(folder.join(FILE_NAME)) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => None,
            opened => Some(opened?),
        };
        if segment_numbers(folder)?.last() == segments.last() {
            return Ok((segments, current));
        }
    }
}

/// Reads the history of a results folder into memory, see [`for_each_line`].
///
/// # Errors
/// [`HistoryError`].
pub fn read_history(folder: &Path) -> Result<(Vec<HistoryLine>, usize), HistoryError> {
    let mut lines = Vec::new();
    let passed_over = for_each_line(folder, |line| lines.push(line))?;
    Ok((lines, passed_over))
}

/// Returns true if a file has the name of a part of the history.
pub(in crate::archive::store) fn is_history_file(name: &str) -> bool {
    name == FILE_NAME || name == days::FILE_NAME || is_segment(name)
}

/// Returns the paths of the parts of the history, except the file of the newest lines: the days,
/// and compressed lines, the oldest first.
///
/// # Errors
/// Those of the file system.
pub fn history_parts(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let days = Some(folder.join(days::FILE_NAME)).filter(|path| path.exists());
    let segments = segment_numbers(folder)?;
    let segments = segments.into_iter().map(|number| segment_path(folder, number));
    Ok(days.into_iter().chain(segments).collect())
}

/// Writes all lines of the history, oldest first, and returns their number.
pub(in crate::archive::store) fn write_parsed_lines(
    folder: &Path,
    out: &mut dyn Write,
) -> io::Result<usize> {
    let (mut written, mut lines) = (Ok(()), 0);
    let read = for_each_line(folder, |line| {
        if written.is_ok() {
            lines += 1;
            written = serde_json::to_writer(&mut *out, &line)
                .map_err(io::Error::from)
                .and_then(|()| out.write_all(b"\n"));
        }
    });
    written?;
    read.map_err(io::Error::other)?;
    Ok(lines)
}

/// Number of lines from which the file is closed at the end of a day, and at once \[1\]. Smaller
/// segments compress worse.
const SEGMENT_LINES: [usize; 2] = [1_000, 10_000];
/// Number of days that results keep a line of their own.
const DAYS_IN_FULL: u64 = 14;

/// A segment on disk.
#[derive(Clone, Copy, Debug)]
struct Segment {
    number: u64,
    lines: usize,
    /// Day of its newest line.
    newest_day: u64,
}

/// The history, opened by its only writer.
#[derive(Debug)]
pub(in crate::archive::store) struct HistoryFile {
    folder: PathBuf,
    path: PathBuf,
    /// Number of bytes of the complete lines. Later bytes in the file are from a failed append.
    length: u64,
    lines: usize,
    /// Result number of the last line when the file was opened.
    last_result: Option<u64>,
    /// Day of the last line in the file, and of its newest one.
    last_day: Option<u64>,
    newest_day: u64,
    /// Number of results that keep a line of their own, however old they are.
    min_lines: usize,
    /// The segments, oldest first.
    segments: Vec<Segment>,
    days: DaysFile,
}

impl HistoryFile {
    /// Opens the history of a folder, in which at least `keep` lines are kept, and returns the last
    /// `recent` lines of the newest file. Removes an incomplete last line, because nothing may be
    /// appended to it, and completes what a killed process has begun.
    pub(in crate::archive::store) fn open(
        folder: &Path,
        keep: usize,
        recent: usize,
    ) -> Result<(Self, VecDeque<HistoryLine>), StoreError> {
        let path = folder.join(FILE_NAME);
        remove_leftovers(folder, is_history_file)
            .map_err(io_error("clean up the folder", folder))?;
        let numbers = segment_numbers(folder).map_err(io_error("read the folder", folder))?;
        let mut last_result = None;
        let mut segments = Vec::new();
        for number in &numbers {
            match scan_segment(folder, *number) {
                Ok((segment, last)) => {
                    segments.push(segment);
                    last_result = last.or(last_result);
                }
                // It stays as it is, and is reported to its readers.
                Err(cause) => {
                    tracing::warn!("{}", read_failure(&segment_path(folder, *number))(cause));
                }
            }
        }
        if let Some(newest) = numbers.last() {
            remove_closed_lines(folder, *newest).map_err(io_error("read", &path))?;
        }
        let mut last = VecDeque::new();
        let (mut last_day, mut newest_day) = (None, 0);
        let scan = match File::open(&path) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => HistoryContent::default(),
            opened => {
                let scanned = opened.and_then(|file| {
                    scan(file, |_, line| {
                        if let Some(line) = &line {
                            last_day = Some(line.time.day());
                            newest_day = newest_day.max(line.time.day());
                        }
                        last.extend(line);
                        if last.len() > recent {
                            last.pop_front();
                        }
                    })
                });
                scanned.map_err(io_error("read", &path))?
            }
        };
        scan.skipped.warn(&path);
        let history = Self {
            folder: folder.to_owned(),
            path,
            length: scan.complete_bytes,
            lines: scan.lines,
            last_result: scan.last_result.or(last_result),
            last_day,
            newest_day,
            min_lines: keep.max(1),
            segments,
            days: DaysFile::open(folder, numbers.first().copied())?,
        };
        if scan.complete_bytes < scan.length {
            history.cut_tail()?;
        }
        Ok((history, last))
    }

    /// Appends a line and syncs it. Closes the file before if it has the lines of a complete day. A
    /// failure to close it is only logged, because the line can be stored nevertheless.
    pub(in crate::archive::store) fn append(
        &mut self,
        line: &HistoryLine,
    ) -> Result<(), StoreError> {
        let day = line.time.day();
        let [at_the_end_of_a_day, at_once] = SEGMENT_LINES;
        let is_next_day = self.last_day.is_some_and(|last| last != day);
        let is_closed = (is_next_day && self.lines >= at_the_end_of_a_day) || self.lines >= at_once;
        if is_closed && let Err(problem) = self.close_segment() {
            tracing::warn!("the newest part of the history is not compressed: {problem}");
        }
        let mut json = serde_json::to_vec(line)?;
        json.push(b'\n');
        let is_new = !self.path.exists();
        let mut file =
            with_disk(|disk| disk.append(&self.path)).map_err(io_error("open", &self.path))?;
        let length = file.length().map_err(io_error("read", &self.path))?;
        if length != self.length {
            self.look_again(length)?;
        }
        let written = file.write_all(&json).and_then(|()| file.sync());
        if let Err(cause) = written {
            // Restores the previous state. If this fails as well, the next append repairs the file.
            let _ = self.cut_tail();
            return Err(io_error("append to", &self.path)(cause));
        }
        self.length += json.len() as u64;
        self.lines += 1;
        self.last_day = Some(day);
        self.newest_day = self.newest_day.max(day);
        if is_new && let Err(problem) = self.sync_folder() {
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

    /// Returns the lines of the oldest segment, if they are to be replaced by rows of days: they
    /// are older than two weeks, and enough newer ones exist.
    pub(in crate::archive::store) fn outdated_segment(
        &self,
        now: Timestamp,
    ) -> Result<Option<(u64, Vec<HistoryLine>)>, StoreError> {
        let Some((oldest, newer)) = self.segments.split_first() else { return Ok(None) };
        let newer_lines = newer.iter().map(|segment| segment.lines).sum::<usize>() + self.lines;
        if oldest.newest_day + DAYS_IN_FULL >= now.day() || newer_lines < self.min_lines {
            return Ok(None);
        }
        let mut lines = Vec::new();
        let read = open_segment(&self.folder, oldest.number)
            .and_then(|segment| scan(segment, |_, line| lines.extend(line)));
        read.map_err(io_error("read", &segment_path(&self.folder, oldest.number)))?;
        Ok(Some((oldest.number, lines)))
    }

    /// Replaces the oldest segment by rows of days.
    pub(in crate::archive::store) fn replace_oldest_segment(
        &mut self,
        rows: &[HistoryLine],
    ) -> Result<(), StoreError> {
        let Some(oldest) = self.segments.first() else { return Ok(()) };
        self.days.append(rows)?;
        let path = segment_path(&self.folder, oldest.number);
        self.segments.remove(0);
        with_disk(|disk| disk.remove(&path)).map_err(io_error("remove", &path))?;
        self.sync_folder()
    }

    /// Compresses the lines of the file into a segment, and empties the file. A segment that a
    /// killed process has written is recognised by its lines at the next start.
    fn close_segment(&mut self) -> Result<(), StoreError> {
        let number = self.segments.last().map(|segment| segment.number).max(self.days.last_segment);
        let number = number.map_or(0, |last| last + 1);
        let mut lines = fs::read(&self.path).map_err(io_error("read", &self.path))?;
        lines.truncate(usize::try_from(self.length).unwrap_or(usize::MAX));
        let path = segment_path(&self.folder, number);
        write_segment(&self.folder, number, &lines).map_err(io_error("write", &path))?;
        self.segments.push(Segment { number, lines: self.lines, newest_day: self.newest_day });
        write(&self.path, &[])?;
        (self.length, self.lines, self.last_day, self.newest_day) = (0, 0, None, 0);
        Ok(())
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
        let file = with_disk(|disk| disk.append(&self.path));
        let cut = file.and_then(|mut file| file.cut(self.length).and_then(|()| file.sync()));
        cut.map_err(io_error("remove an incomplete line from", &self.path))
    }

    fn sync_folder(&self) -> Result<(), StoreError> {
        let synced = with_disk(|disk| disk.sync_folder(&self.folder));
        synced.map_err(io_error("sync", &self.folder))
    }
}

/// Counts the lines of a segment. Also returns the result number of the last one.
fn scan_segment(folder: &Path, number: u64) -> io::Result<(Segment, Option<u64>)> {
    let mut newest_day = 0;
    let scan = scan(open_segment(folder, number)?, |_, line| {
        newest_day = newest_day.max(line.map_or(0, |line| line.time.day()));
    })?;
    Ok((Segment { number, lines: scan.lines, newest_day }, scan.last_result))
}

/// Removes the lines of the newest segment from the beginning of the file. They are in both if the
/// process was killed between writing the segment and emptying the file.
fn remove_closed_lines(folder: &Path, newest: u64) -> io::Result<()> {
    let path = folder.join(FILE_NAME);
    let lines = match fs::read(&path) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(()),
        read => read?,
    };
    let Ok(mut segment) = open_segment(folder, newest) else { return Ok(()) };
    let mut closed = Vec::new();
    if segment.read_to_end(&mut closed).is_err() || closed.is_empty() {
        return Ok(());
    }
    match lines.strip_prefix(&closed[..]) {
        Some(rest) => replace(&path, |out| out.write_all(rest)),
        None => Ok(()),
    }
}
