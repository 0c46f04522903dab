//! A recording as a source: read at the speed of the caller, in bounded memory.

use core::ops::Range;
use core::time::Duration;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::bytes::{ByteReader, ChunkHead};
use super::content::FileContent;
use super::error::{Corruption, McapError};
use super::info::McapInfo;
use super::op;
use super::records::{FileEnd, Records};
use crate::frame::Frame;
use crate::source::{
    InterfaceName, Received, Source, SourceCounters, SourceError, StampClock, capacity,
};

/// Frames of an MCAP file, in the order of the recording.
///
/// A call never waits and never returns [`Received::Silence`](crate::source::Received::Silence).
/// Messages that are no frames are skipped and counted.
#[derive(Debug)]
pub struct McapSource<R = BufReader<File>> {
    records: Records<R>,
    content: FileContent,
    /// Unread records of the chunk in memory.
    unread_range: Range<usize>,
    /// A message outside of any chunk.
    unchunked_frame: Option<Frame>,
    /// Frame for the next call: frames are missing before it, but not before the frames of this
    /// call.
    next_frame: Option<Frame>,
    /// Error for the next call, after the frames before it.
    failure: Option<McapError>,
}

impl McapSource {
    /// Opens a recording, like [`TextLog::open`](crate::source::TextLog::open) a log: with names,
    /// frames of other interfaces are skipped and counted.
    ///
    /// # Errors
    /// [`McapError`]: it cannot be opened, is no MCAP file, or its beginning is damaged.
    pub fn open(path: &Path, interfaces: &[InterfaceName]) -> Result<Self, McapError> {
        match File::open(path) {
            Ok(file) => Self::new(BufReader::new(file), path, interfaces),
            Err(source) => Err(McapError::Open { path: path.into(), source }),
        }
    }
}

impl<R: Read> McapSource<R> {
    /// Reads a recording from any reader like [`McapSource::open`]; errors name it `path`.
    ///
    /// # Errors
    /// The same as [`McapSource::open`].
    pub fn new(reader: R, path: &Path, interfaces: &[InterfaceName]) -> Result<Self, McapError> {
        let mut source = Self {
            records: Records::new(reader, path)?,
            content: FileContent::new(interfaces),
            unread_range: 0..0,
            unchunked_frame: None,
            next_frame: None,
            failure: None,
        };
        // The records before the first frame contain the interfaces and the time.
        while source.unread_range.is_empty()
            && source.unchunked_frame.is_none()
            && source.load_chunk()?
        {}
        Ok(source)
    }

    /// Returns the file's description, or `None` for a file of another program.
    pub fn info(&self) -> Option<&McapInfo> {
        self.content.info()
    }

    /// Returns the kind of the file's end, or `None` before the end is reached.
    pub fn file_end(&self) -> Option<FileEnd> {
        self.records.end()
    }

    /// Returns the sequence of the last frame, for the file that continues this one.
    pub fn last_sequence(&self) -> Option<u32> {
        self.content.sequence
    }

    /// Counts missing frames from this sequence on, which is that of the last frame of the previous
    /// file.
    pub fn continue_from(&mut self, sequence: Option<u32>) {
        self.content.sequence = sequence;
    }

    /// Returns the next frame, or `None` at the end.
    ///
    /// # Errors
    /// [`McapError`]; [`McapError::is_recoverable`] is true if the call may be repeated.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, McapError> {
        let next = match self.next_frame.take() {
            Some(frame) => Ok(Some(frame)),
            None => self.read_frame(),
        };
        self.count_missing();
        next
    }

    fn count_missing(&mut self) {
        self.content.counters.queue_drops += core::mem::take(&mut self.content.missing_frames);
    }

    /// Returns the next frame; missing frames before it are not counted yet.
    fn read_frame(&mut self) -> Result<Option<Frame>, McapError> {
        loop {
            if let Some(frame) = self.unchunked_frame.take() {
                return Ok(Some(frame));
            }
            if self.unread_range.is_empty() {
                if !self.load_chunk()? {
                    return Ok(None);
                }
                continue;
            }
            match self.next_in_chunk() {
                Ok(Some(frame)) => return Ok(Some(frame)),
                Ok(None) => {}
                Err(what) => {
                    self.unread_range = 0..0;
                    return Err(self.records.corruption_error(what));
                }
            }
        }
    }

    /// Reads the next record; returns false at the end.
    fn load_chunk(&mut self) -> Result<bool, McapError> {
        let Some(opcode) = self.records.advance()? else { return Ok(false) };
        let body = self.records.last_body();
        let brought = if opcode == op::CHUNK {
            chunk_records(body).map(|place| {
                self.unread_range = place;
                None
            })
        } else {
            self.content.handle_record(opcode, body)
        };
        self.unchunked_frame = brought.map_err(|what| self.records.corruption_error(what))?;
        Ok(true)
    }

    /// Returns the next record of the chunk.
    fn next_in_chunk(&mut self) -> Result<Option<Frame>, Corruption> {
        let chunk = self.records.last_body().get(self.unread_range.clone()).unwrap_or_default();
        let mut bytes = ByteReader(chunk);
        let malformed = Corruption::Malformed("chunk");
        let (Some(opcode), Some(length)) = (bytes.take_u8(), bytes.take_u64()) else {
            return Err(malformed);
        };
        let body = usize::try_from(length).ok().and_then(|length| bytes.take(length));
        let Some(body) = body else { return Err(malformed) };
        self.unread_range.start = self.unread_range.end - bytes.0.len();
        self.content.handle_record(opcode, body)
    }
}

/// Returns the position of the records of a chunk if its CRC matches.
fn chunk_records(body: &[u8]) -> Result<Range<usize>, Corruption> {
    let mut bytes = ByteReader(body);
    let head = ChunkHead::read(&mut bytes).ok_or(Corruption::Malformed("chunk"))?;
    if !head.compression.is_empty() {
        return Err(Corruption::Compressed(head.compression.chars().take(16).collect()));
    }
    let start = body.len() - bytes.0.len();
    let records = usize::try_from(head.length).ok().and_then(|length| bytes.take(length));
    let records = records.ok_or(Corruption::Malformed("chunk"))?;
    // 0 means that there is no CRC.
    if head.crc != 0 && head.crc != crc32fast::hash(records) {
        return Err(Corruption::Crc);
    }
    Ok(start..start + records.len())
}

impl<R: Read + Send> Source for McapSource<R> {
    fn receive(&mut self, batch: &mut Vec<Frame>, _: Duration) -> Result<Received, SourceError> {
        if capacity(batch) == 0 {
            return Err(SourceError::NoRoom);
        }
        if let Some(failure) = self.failure.take() {
            return Err(failure.into());
        }
        let before = batch.len();
        let mut next = self.next_frame.take();
        while capacity(batch) > 0 {
            let read = next.take().map_or_else(|| self.read_frame(), |frame| Ok(Some(frame)));
            match read {
                Ok(Some(frame)) if self.content.missing_frames > 0 && batch.len() > before => {
                    self.next_frame = Some(frame);
                    break;
                }
                Ok(Some(frame)) => {
                    self.count_missing();
                    self.content.counters.frames += 1;
                    self.content.counters.error_frames += u64::from(frame.is_error());
                    batch.push(frame);
                }
                Ok(None) => break,
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
        self.content.counters
    }

    fn interfaces(&self) -> &[InterfaceName] {
        self.content.interfaces()
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }

    fn since_1970_ns(&self) -> i64 {
        self.info().map_or(0, |info| info.offset_ns)
    }
}
