//! Source for a text log. It reads at the speed of the caller, in constant memory.

use core::time::Duration;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use super::format::Format;
use super::{LineFault, MAX_LINE, TextLogError};
use crate::frame::Frame;
use crate::source::{
    InterfaceName, MAX_INTERFACES, Received, Source, SourceCounters, SourceError, StampClock,
    TooManyInterfaces, capacity, index_of,
};

/// Number of bytes at the beginning of a file by which its kind and its stamps are detected: some
/// hundred frames.
const DETECTION_BYTES: u64 = 16 * 1024;

/// Source of the frames of a text log, in the order of its lines.
///
/// A call never waits and never returns [`Received::Silence`](crate::source::Received::Silence).
/// Replay runs at the speed of the caller.
#[derive(Debug)]
pub struct TextLog<R = BufReader<File>> {
    reader: R,
    /// Path of the log, which every error names.
    path: PathBuf,
    /// Number of lines read until now.
    line: u64,
    buffer: Vec<u8>,
    /// Format of the log, detected from its first line.
    format: Option<Format>,
    interfaces: Vec<InterfaceName>,
    /// True if the caller chose `interfaces`. Otherwise every interface of the log is added to
    /// them.
    has_fixed_interfaces: bool,
    /// Error that the next call returns, after the frames that precede it.
    failure: Option<TextLogError>,
    has_ended: bool,
    /// True if the last line of the file is cut off. It is skipped.
    is_truncated: bool,
    counters: SourceCounters,
}

impl TextLog {
    /// Returns true if a file begins like a log.
    pub fn is_one(path: &Path) -> bool {
        let begin = begin_of(path);
        let first = begin.trim_ascii_start();
        first.starts_with(b"(") || !Format::detect(first).ends_lines()
    }

    /// Returns true if the last line of the log is cut off. Its frames are those of the lines
    /// before.
    pub fn is_truncated(&self) -> bool {
        self.is_truncated
    }

    /// Returns true if the stamps of the log are the times since the frame before, as `candump -td`
    /// writes them. The frames have the sums of these stamps, from 0.
    pub fn adds_stamps(&self) -> bool {
        self.format.as_ref().is_some_and(Format::adds_stamps)
    }

    /// Opens a log. A last line that is cut off is skipped ([`TextLog::is_truncated`]).
    ///
    /// If `interfaces` is not empty, frames of other interfaces are skipped and counted. Otherwise
    /// the frames of all interfaces are returned. The interfaces are then numbered in the order of
    /// their first appearance in the log.
    ///
    /// # Errors
    /// [`TextLogError::Open`].
    pub fn open(path: &Path, interfaces: &[InterfaceName]) -> Result<Self, TextLogError> {
        match File::open(path) {
            Ok(mut file) => {
                let open = |source| TextLogError::Open { path: path.into(), source };
                let (begin, is_truncated) = inspect(&mut file).map_err(open)?;
                let format = (!begin.is_empty()).then(|| Format::detect(&begin));
                let ends_lines = format.as_ref().is_some_and(Format::ends_lines);
                let log = Self::new(BufReader::new(file), path, interfaces);
                Ok(Self { is_truncated: is_truncated && ends_lines, format, ..log })
            }
            Err(source) => Err(TextLogError::Open { path: path.into(), source }),
        }
    }
}

impl<R: BufRead> TextLog<R> {
    /// Reads a log from any reader, like [`TextLog::open`]. Errors name the log `path`.
    pub fn new(reader: R, path: &Path, interfaces: &[InterfaceName]) -> Self {
        let mut interfaces_seen = Vec::with_capacity(MAX_INTERFACES.max(interfaces.len()));
        interfaces_seen.extend_from_slice(interfaces);
        Self {
            reader,
            path: path.into(),
            line: 0,
            buffer: Vec::with_capacity(MAX_LINE),
            format: None,
            interfaces: interfaces_seen,
            has_fixed_interfaces: !interfaces.is_empty(),
            failure: None,
            has_ended: false,
            is_truncated: false,
            counters: SourceCounters::default(),
        }
    }

    /// Returns the next frame that is not skipped, or `None` at the end.
    fn next_frame(&mut self) -> Result<Option<Frame>, TextLogError> {
        while self.read_line()? {
            let buffer = &self.buffer;
            let format = self.format.get_or_insert_with(|| Format::detect(buffer));
            let parsed = match format.parse(buffer) {
                // The line is a header, or an event that is not a frame.
                Ok(None) => continue,
                Ok(Some((name, frame))) => {
                    self.index_of(name).map(|index| index.map(|index| frame.on_interface(index)))
                }
                Err(fault) => Err(fault),
            };
            match parsed {
                Ok(Some(frame)) => return Ok(Some(frame)),
                Ok(None) => self.counters.passed_over += 1,
                Err(fault) => return Err(self.at_line(fault)),
            }
        }
        Ok(None)
    }

    /// Reads the next line into the buffer, without its newline. Returns false at the end.
    fn read_line(&mut self) -> Result<bool, TextLogError> {
        self.buffer.clear();
        let limit = u64::try_from(MAX_LINE).unwrap_or(u64::MAX);
        self.line += 1;
        match self.reader.by_ref().take(limit).read_until(b'\n', &mut self.buffer) {
            Ok(0) => return Ok(false),
            Ok(_) => {}
            Err(source) => {
                self.has_ended = true;
                return Err(TextLogError::Read {
                    path: self.path.clone(),
                    line: self.line,
                    source,
                });
            }
        }
        if self.buffer.pop_if(|last| *last == b'\n').is_some() {
            return Ok(true);
        }
        if self.buffer.len() < MAX_LINE {
            self.has_ended = true;
            if self.format.as_ref().is_some_and(|format| !format.ends_lines()) {
                return Ok(true);
            }
            if self.is_truncated {
                return Ok(false);
            }
            return Err(TextLogError::Truncated { path: self.path.clone(), line: self.line });
        }
        // Without a newline the end of the line is unknown, so reading cannot continue.
        self.has_ended = true;
        Err(self.at_line(LineFault::TooLong))
    }

    fn index_of(&mut self, name: InterfaceName) -> Result<Option<u8>, LineFault> {
        index_of(&mut self.interfaces, name, self.has_fixed_interfaces)
            .map_err(|TooManyInterfaces| LineFault::TooManyInterfaces)
    }

    fn at_line(&self, fault: LineFault) -> TextLogError {
        TextLogError::Line { path: self.path.clone(), line: self.line, fault }
    }
}

impl<R: BufRead + Send> Source for TextLog<R> {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        _timeout: Duration,
    ) -> Result<Received, SourceError> {
        if capacity(batch) == 0 {
            return Err(SourceError::NoRoom);
        }
        if let Some(failure) = self.failure.take() {
            return Err(failure.into());
        }
        let before = batch.len();
        while !self.has_ended && capacity(batch) > 0 {
            match self.next_frame() {
                Ok(Some(frame)) => {
                    self.counters.frames += 1;
                    self.counters.error_frames += u64::from(frame.is_error());
                    batch.push(frame);
                }
                Ok(None) => self.has_ended = true,
                Err(failure) if batch.len() == before => return Err(failure.into()),
                Err(failure) => {
                    self.failure = Some(failure);
                    break;
                }
            }
        }
        Ok(if batch.len() > before { Received::Frames } else { Received::End })
    }

    fn counters(&self) -> SourceCounters {
        self.counters
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }
}

/// Returns the first bytes of a file; nothing if it cannot be read.
fn begin_of(path: &Path) -> Vec<u8> {
    let mut begin = Vec::new();
    let _ = File::open(path).and_then(|file| file.take(DETECTION_BYTES).read_to_end(&mut begin));
    begin
}

/// Returns the first bytes of a file, and true if its last byte is no newline. Goes back to its
/// beginning. A pipe, which cannot go back, has no first bytes here.
fn inspect(file: &mut File) -> std::io::Result<(Vec<u8>, bool)> {
    let (mut begin, mut last) = (Vec::new(), [b'\n']);
    if file.metadata()?.len() > 0 {
        file.by_ref().take(DETECTION_BYTES).read_to_end(&mut begin)?;
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        file.rewind()?;
    }
    Ok((begin, last != *b"\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> TextLog<&[u8]> {
        TextLog::new(text.as_bytes(), Path::new("a.log"), &[])
    }

    fn drain(source: &mut impl Source) -> (Vec<Frame>, Vec<String>) {
        let (mut frames, mut faults) = (Vec::new(), Vec::new());
        let mut batch = Vec::with_capacity(3);
        loop {
            match source.receive(&mut batch, Duration::ZERO) {
                Ok(Received::End) => return (frames, faults),
                Ok(_) => frames.append(&mut batch),
                Err(error) => faults.push(error.to_string()),
            }
        }
    }

    #[test]
    fn a_bad_line_is_named_after_the_frames_before_it_and_passed_over() {
        let mut log = source("(1.0) can0 001#\n(2.0) can0 00#\n(3.0) can0 003#\n");
        let (frames, faults) = drain(&mut log);
        assert_eq!(frames.iter().map(|frame| frame.id.number()).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(faults.len(), 1);
        assert!(faults[0].starts_with("a.log:2: the identifier"), "{faults:?}");
    }

    #[test]
    fn a_log_cut_off_says_so_even_where_the_line_looks_whole() {
        let log = "(1.0) can0 001#1122\n(2.0) can0 002#3344\n";
        for cut in 1..log.len() {
            let (frames, faults) = drain(&mut source(&log[..cut]));
            let lines = log[..cut].matches('\n').count();
            assert_eq!(frames.len(), lines, "cut at {cut}");
            let expected = usize::from(!log[..cut].ends_with('\n'));
            assert_eq!(faults.len(), expected, "cut at {cut}: {faults:?}");
            assert!(faults.iter().all(|fault| fault.contains("cut off")), "{faults:?}");
        }
    }

    #[test]
    fn a_file_without_newlines_is_given_up_after_one_line() {
        let (frames, faults) = drain(&mut source(&"x".repeat(1_000_000)));
        assert!(frames.is_empty());
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].contains("not a candump log"), "{faults:?}");
    }

    #[test]
    fn interfaces_are_numbered_as_seen_or_as_listed() {
        let text = "(1.0) can1 001#\n(2.0) can0 002#\n(3.0) can1 003#\n";
        let (frames, _) = drain(&mut source(text));
        assert_eq!(frames.iter().map(|frame| frame.interface).collect::<Vec<_>>(), [0, 1, 0]);

        let only = [InterfaceName::new("can0").unwrap()];
        let mut log = TextLog::new(text.as_bytes(), Path::new("a.log"), &only);
        let (frames, _) = drain(&mut log);
        assert_eq!(frames.iter().map(|frame| frame.id.number()).collect::<Vec<_>>(), [2]);
        assert_eq!(log.counters().passed_over, 2);
    }

    #[test]
    fn the_seventeenth_interface_is_refused() {
        let text: String = (0..17).map(|n| format!("(1.0) can{n} 001#\n")).collect();
        let (frames, faults) = drain(&mut source(&text));
        assert_eq!((frames.len(), faults.len()), (16, 1));
    }

    #[test]
    fn a_table_of_frames_is_named() {
        for text in ["Time Stamp,ID,Extended,Dir,Bus,LEN\n", "1;2;3;4\n"] {
            let error = source(text).next_frame().unwrap_err();
            assert!(
                matches!(error, TextLogError::Line { line: 1, fault: LineFault::Table, .. }),
                "{error}"
            );
        }
        let error = source("a log, or none\n").next_frame().unwrap_err();
        assert!(matches!(error, TextLogError::Line { fault: LineFault::Stamp, .. }), "{error}");
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = TextLog::open(Path::new("/nonexistent.log"), &[]).unwrap_err();
        assert!(error.to_string().contains("/nonexistent.log"), "{error}");
    }
}
