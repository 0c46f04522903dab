//! Reader of a history that another process writes. It returns each line once, in order.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::file::{FILE_NAME, HistoryError, MAX_LINE, parse_line};
use super::line::HistoryLine;
use crate::archive::store::timestamp::Timestamp;

/// Position in a history up to which it has been read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HistoryMark {
    /// [`HistoryLine::identity`] of the last line that was read.
    pub identity: String,
    /// Number of the line's result.
    pub result: u64,
    /// Time at which the result was stored.
    pub time: Timestamp,
}

impl HistoryMark {
    /// Returns the mark of a line.
    pub fn from_line(line: &HistoryLine) -> Self {
        Self { identity: line.identity(), result: line.result, time: line.time }
    }

    fn is_at(&self, line: &HistoryLine) -> bool {
        (line.result, line.time) == (self.result, self.time) && line.identity() == self.identity
    }

    /// Returns true if a line came after the mark. It is used if the line of the mark no longer
    /// exists. An emptied folder counts from 0 again.
    fn is_before(&self, line: &HistoryLine) -> bool {
        line.result > self.result || line.time > self.time
    }
}

/// Reader of the lines of a history after a mark. It keeps no line in memory.
#[derive(Debug)]
pub struct HistoryFollower {
    path: PathBuf,
    mark: Option<HistoryMark>,
    /// Inode of the file, and the read position \[bytes\]. `None` before the first read.
    read_position: Option<(u64, u64)>,
    passed_over: u64,
}

impl HistoryFollower {
    /// Creates a reader for the history in a results folder. It reads all lines, or those after a
    /// mark.
    pub fn new(folder: &Path, mark: Option<HistoryMark>) -> Self {
        Self { path: folder.join(FILE_NAME), mark, read_position: None, passed_over: 0 }
    }

    /// Returns the next line, or `None` while there is none. If the writer has shortened the
    /// history or started a new one, the reading continues after the last returned line. If that
    /// line is gone, it continues with the first later line.
    ///
    /// # Errors
    /// [`HistoryError::Io`]; the call can be repeated.
    pub fn next_line(&mut self) -> Result<Option<HistoryLine>, HistoryError> {
        let read = self.read();
        read.map_err(|cause| HistoryError::Io { path: self.path.clone(), cause })
    }

    /// Returns the number of unreadable lines, including those of a later version.
    pub fn passed_over(&self) -> u64 {
        self.passed_over
    }

    fn read(&mut self) -> io::Result<Option<HistoryLine>> {
        let mut file = match File::open(&self.path) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        let data = file.metadata()?;
        let place =
            self.read_position.filter(|(inode, at)| *inode == data.ino() && *at <= data.len());
        let mut offset = match place {
            Some((_, at)) => at,
            None => self.find(&file)?,
        };
        file.seek(SeekFrom::Start(offset))?;
        let mut reader = BufReader::new(file);
        let mut text = Vec::new();
        let line = loop {
            let read = read_piece(&mut reader, &mut text)?;
            // The last line may be incomplete.
            if read == 0 || (!text.ends_with(b"\n") && read < MAX_LINE) {
                break None;
            }
            offset += read;
            match parse_line(&text) {
                Some((_, Some(line))) => break Some(line),
                _ => self.passed_over += 1,
            }
        };
        self.read_position = Some((data.ino(), offset));
        if let Some(line) = &line {
            self.mark = Some(HistoryMark::from_line(line));
        }
        Ok(line)
    }

    /// Finds the position in a replaced file at which the reading continues \[bytes\].
    fn find(&self, file: &File) -> io::Result<u64> {
        let Some(mark) = &self.mark else { return Ok(0) };
        let mut reader = BufReader::new(file);
        let (mut text, mut at, mut later) = (Vec::new(), 0, None);
        loop {
            let read = read_piece(&mut reader, &mut text)?;
            if read == 0 {
                return Ok(later.unwrap_or(at));
            }
            if let Some((_, Some(line))) = parse_line(&text) {
                if mark.is_at(&line) {
                    return Ok(at + read);
                }
                if later.is_none() && mark.is_before(&line) {
                    later = Some(at);
                }
            }
            at += read;
        }
    }
}

/// Reads a line, or its next part of at most the maximum line length.
fn read_piece(reader: &mut impl BufRead, text: &mut Vec<u8>) -> io::Result<u64> {
    text.clear();
    Ok(reader.take(MAX_LINE).read_until(b'\n', text)? as u64)
}
