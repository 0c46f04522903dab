//! Reader of a history that another process writes. It returns each line once, in order.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::file::{FILE_NAME, HistoryError, open_parts};
use super::line::HistoryLine;
use super::scan::{MAX_LINE, parse_line};
use super::segments::open_segment;
use crate::archive::store::timestamp::Timestamp;
use crate::files::file_number;

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

/// Position of a follower.
enum Position {
    /// Nothing has been read yet, or the files were replaced by others.
    Unknown,
    /// In a segment, with its open reader. Its number is kept for the next one.
    Segment(u64, Box<dyn BufRead + Send>),
    /// In the file of the newest lines: its inode, and the read position \[bytes\].
    Newest(u64, u64),
}

impl core::fmt::Debug for Position {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unknown => f.write_str("Unknown"),
            Self::Segment(number, _) => f.debug_tuple("Segment").field(number).finish(),
            Self::Newest(inode, at) => f.debug_tuple("Newest").field(inode).field(at).finish(),
        }
    }
}

/// Reader of the lines of a history after a mark. It keeps no line in memory. The rows of days are
/// not returned, because their results were.
#[derive(Debug)]
pub struct HistoryFollower {
    folder: PathBuf,
    path: PathBuf,
    mark: Option<HistoryMark>,
    position: Position,
    /// Number of the newest segment at the last look.
    newest_segment: Option<u64>,
    passed_over: u64,
}

impl HistoryFollower {
    /// Creates a reader for the history in a results folder. It reads all lines, or those after a
    /// mark.
    pub fn new(folder: &Path, mark: Option<HistoryMark>) -> Self {
        Self {
            folder: folder.to_owned(),
            path: folder.join(FILE_NAME),
            mark,
            position: Position::Unknown,
            newest_segment: None,
            passed_over: 0,
        }
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
        loop {
            let (line, ended) = match std::mem::replace(&mut self.position, Position::Unknown) {
                Position::Unknown => {
                    self.position = self.find()?;
                    if matches!(self.position, Position::Unknown) {
                        return Ok(None);
                    }
                    continue;
                }
                Position::Segment(number, mut reader) => {
                    let line = self.next_of(&mut reader)?.1;
                    self.position = match line {
                        Some(_) => Position::Segment(number, reader),
                        None => self.after_segment(number)?,
                    };
                    (line, false)
                }
                Position::Newest(inode, at) => self.read_newest(inode, at)?,
            };
            if let Some(line) = &line {
                self.mark = Some(HistoryMark::from_line(line));
            }
            if line.is_some() || ended {
                return Ok(line);
            }
        }
    }

    /// Reads the next line of the file of the newest lines. Returns true if there is nothing more
    /// to read now.
    fn read_newest(&mut self, inode: u64, at: u64) -> io::Result<(Option<HistoryLine>, bool)> {
        let (segments, file) = open_parts(&self.folder)?;
        let newest = segments.last().copied();
        // The file has become a segment, of which a part has been read.
        if newest > self.newest_segment {
            let number = self.newest_segment.map_or(segments[0], |last| last + 1);
            self.newest_segment = newest;
            if segments.contains(&number) {
                let mut reader = BufReader::new(open_segment(&self.folder, number)?);
                io::copy(&mut (&mut reader).take(at), &mut io::sink())?;
                self.position = Position::Segment(number, Box::new(reader));
            }
            return Ok((None, false));
        }
        // A file that comes back is another one, whatever its number.
        let Some(mut file) = file else { return Ok((None, true)) };
        let data = file.metadata()?;
        if file_number(&data) != inode || at > data.len() {
            return Ok((None, false));
        }
        file.seek(SeekFrom::Start(at))?;
        let (read, line) = self.next_of(&mut BufReader::new(file))?;
        self.position = Position::Newest(inode, at + read);
        let ended = line.is_none();
        Ok((line, ended))
    }

    /// Returns the number of bytes up to the end of the next readable line, and the line.
    fn next_of(&mut self, reader: &mut impl BufRead) -> io::Result<(u64, Option<HistoryLine>)> {
        let (mut text, mut bytes) = (Vec::new(), 0);
        loop {
            let read = read_piece(reader, &mut text)?;
            // The last line may be incomplete.
            if read == 0 || (!text.ends_with(b"\n") && read < MAX_LINE) {
                return Ok((bytes, None));
            }
            bytes += read;
            match parse_line(&text) {
                Some((_, Some(line))) => return Ok((bytes, Some(line))),
                _ => self.passed_over += 1,
            }
        }
    }

    /// Returns the position after the end of a segment.
    fn after_segment(&mut self, number: u64) -> io::Result<Position> {
        let (segments, file) = open_parts(&self.folder)?;
        self.newest_segment = segments.last().copied().or(self.newest_segment);
        match segments.into_iter().find(|next| *next > number) {
            Some(next) => {
                let reader = BufReader::new(open_segment(&self.folder, next)?);
                Ok(Position::Segment(next, Box::new(reader)))
            }
            None => newest_from(file, 0),
        }
    }

    /// Finds the position at which the reading continues. [`Position::Unknown`] without a history.
    fn find(&mut self) -> io::Result<Position> {
        let (segments, file) = open_parts(&self.folder)?;
        self.newest_segment = segments.last().copied();
        let mut later = None;
        for number in segments.iter().copied() {
            let mut reader = BufReader::new(open_segment(&self.folder, number)?);
            match self.find_in(&mut reader)? {
                Found::After(_) => return Ok(Position::Segment(number, Box::new(reader))),
                Found::Later(at) if later.is_none() => later = Some((number, at)),
                _ => {}
            }
        }
        let at = match &file {
            Some(file) => self.find_in(&mut BufReader::new(file))?,
            None => Found::Nothing(0),
        };
        if !matches!(at, Found::After(_))
            && let Some((number, at)) = later
        {
            let mut reader = BufReader::new(open_segment(&self.folder, number)?);
            io::copy(&mut (&mut reader).take(at), &mut io::sink())?;
            return Ok(Position::Segment(number, Box::new(reader)));
        }
        let (Found::After(at) | Found::Later(at) | Found::Nothing(at)) = at;
        newest_from(file, at)
    }

    /// Looks for the mark in a file. Without a mark, everything is later.
    fn find_in(&self, reader: &mut impl BufRead) -> io::Result<Found> {
        let Some(mark) = &self.mark else { return Ok(Found::Later(0)) };
        let (mut text, mut at, mut later) = (Vec::new(), 0, None);
        loop {
            let read = read_piece(reader, &mut text)?;
            if read == 0 {
                return Ok(later.map_or(Found::Nothing(at), Found::Later));
            }
            if let Some((_, Some(line))) = parse_line(&text) {
                if mark.is_at(&line) {
                    return Ok(Found::After(at + read));
                }
                if later.is_none() && mark.is_before(&line) {
                    later = Some(at);
                }
            }
            at += read;
        }
    }
}

/// Outcome of the search for a mark in a file.
enum Found {
    /// Position after the line of the mark \[bytes\].
    After(u64),
    /// Position of the first later line \[bytes\].
    Later(u64),
    /// Neither; the end of the file \[bytes\].
    Nothing(u64),
}

fn newest_from(file: Option<File>, at: u64) -> io::Result<Position> {
    let inode = file.map(|file| file.metadata()).transpose()?.map(|data| file_number(&data));
    Ok(inode.map_or(Position::Unknown, |inode| Position::Newest(inode, at)))
}

/// Reads a line, or its next part of at most the maximum line length.
fn read_piece(reader: &mut impl BufRead, text: &mut Vec<u8>) -> io::Result<u64> {
    text.clear();
    Ok(reader.take(MAX_LINE).read_until(b'\n', text)? as u64)
}
