//! Follows a history that another process writes: each line once, in its order.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::file::{HistoryError, MAX_LINE, NAME, understand};
use super::line::HistoryLine;
use crate::archive::store::timestamp::Timestamp;

/// The line up to which a history is known, for another process to go on from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HistoryMark {
    /// Its [`HistoryLine::identity`].
    pub identity: String,
    /// The number of its result.
    pub result: u64,
    /// When it was stored.
    pub time: Timestamp,
}

impl HistoryMark {
    /// That of a line.
    pub fn of(line: &HistoryLine) -> Self {
        Self { identity: line.identity(), result: line.result, time: line.time }
    }

    fn is_at(&self, line: &HistoryLine) -> bool {
        (line.result, line.time) == (self.result, self.time) && line.identity() == self.identity
    }

    /// Whether a line came later, where the line of the mark is gone: a folder that was emptied counts from 0.
    fn is_before(&self, line: &HistoryLine) -> bool {
        line.result > self.result || line.time > self.time
    }
}

/// Reads the lines of a history that come after a mark. It keeps no line.
#[derive(Debug)]
pub struct HistoryFollower {
    path: PathBuf,
    mark: Option<HistoryMark>,
    /// Inode of the file, and how far it is read \[bytes\]; nothing before the first look.
    place: Option<(u64, u64)>,
    passed_over: u64,
}

impl HistoryFollower {
    /// Of the history in a folder of results: of all of it, or of what comes after a mark.
    pub fn new(folder: &Path, mark: Option<HistoryMark>) -> Self {
        Self { path: folder.join(NAME), mark, place: None, passed_over: 0 }
    }

    /// The next line, or nothing as long as there is none. A history that its writer has shortened, or that was begun
    /// anew, is read from the line after the last one that was given, or from the first that came later.
    ///
    /// # Errors
    /// [`HistoryError::Io`]; it can be tried again.
    pub fn next_line(&mut self) -> Result<Option<HistoryLine>, HistoryError> {
        let read = self.read();
        read.map_err(|cause| HistoryError::Io { path: self.path.clone(), cause })
    }

    /// Lines that could not be read, those of a later version among them.
    pub fn passed_over(&self) -> u64 {
        self.passed_over
    }

    fn read(&mut self) -> io::Result<Option<HistoryLine>> {
        let mut file = match File::open(&self.path) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        let data = file.metadata()?;
        let known = self.place.filter(|(inode, at)| *inode == data.ino() && *at <= data.len());
        let mut at = match known {
            Some((_, at)) => at,
            None => self.find(&file)?,
        };
        file.seek(SeekFrom::Start(at))?;
        let mut reader = BufReader::new(file);
        let mut text = Vec::new();
        let line = loop {
            let read = read_piece(&mut reader, &mut text)?;
            // The last line may be half there.
            if read == 0 || (!text.ends_with(b"\n") && read < MAX_LINE) {
                break None;
            }
            at += read;
            match understand(&text) {
                Some((_, Some(line))) => break Some(line),
                _ => self.passed_over += 1,
            }
        };
        self.place = Some((data.ino(), at));
        if let Some(line) = &line {
            self.mark = Some(HistoryMark::of(line));
        }
        Ok(line)
    }

    /// Where to go on in a file that is another one than before \[bytes\].
    fn find(&self, file: &File) -> io::Result<u64> {
        let Some(mark) = &self.mark else { return Ok(0) };
        let mut reader = BufReader::new(file);
        let (mut text, mut at, mut later) = (Vec::new(), 0, None);
        loop {
            let read = read_piece(&mut reader, &mut text)?;
            if read == 0 {
                return Ok(later.unwrap_or(at));
            }
            if let Some((_, Some(line))) = understand(&text) {
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

/// Reads a line, or as much of it as one may have.
fn read_piece(reader: &mut impl BufRead, text: &mut Vec<u8>) -> io::Result<u64> {
    text.clear();
    Ok(reader.take(MAX_LINE).read_until(b'\n', text)? as u64)
}
