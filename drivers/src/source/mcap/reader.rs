//! A recording as a source: read at the speed of the caller, in bounded memory.

use core::ops::Range;
use core::time::Duration;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::bytes::{Bytes, ChunkHead};
use super::content::Content;
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
/// It never waits and is never silent. Messages that are no frames are skipped and counted.
#[derive(Debug)]
pub struct McapSource<R = BufReader<File>> {
    records: Records<R>,
    content: Content,
    /// Unread records of the chunk in memory.
    place: Range<usize>,
    /// A message outside of any chunk.
    single: Option<Frame>,
    /// Frame for the next call: frames are missing before it, but not before the frames of this
    /// call.
    pending: Option<Frame>,
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
            content: Content::new(interfaces),
            place: 0..0,
            single: None,
            pending: None,
            failure: None,
        };
        // The records before the first frame contain the interfaces and the time.
        while source.place.is_empty() && source.single.is_none() && source.load()? {}
        Ok(source)
    }

    /// Returns the file's description, or `None` for a file of another program.
    pub fn info(&self) -> Option<&McapInfo> {
        self.content.info()
    }

    /// Returns the kind of the file's end, or `None` before the end is reached.
    pub fn ending(&self) -> Option<FileEnd> {
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
        let next = match self.pending.take() {
            Some(frame) => Ok(Some(frame)),
            None => self.read_frame(),
        };
        self.count_missing();
        next
    }

    fn count_missing(&mut self) {
        self.content.counters.queue_drops += core::mem::take(&mut self.content.missing);
    }

    /// Returns the next frame; missing frames before it are not counted yet.
    fn read_frame(&mut self) -> Result<Option<Frame>, McapError> {
        loop {
            if let Some(frame) = self.single.take() {
                return Ok(Some(frame));
            }
            if self.place.is_empty() {
                if !self.load()? {
                    return Ok(None);
                }
                continue;
            }
            match self.next_in_chunk() {
                Ok(Some(frame)) => return Ok(Some(frame)),
                Ok(None) => {}
                Err(what) => {
                    self.place = 0..0;
                    return Err(self.records.damaged(what));
                }
            }
        }
    }

    /// Reads the next record; returns false at the end.
    fn load(&mut self) -> Result<bool, McapError> {
        let Some(opcode) = self.records.advance()? else { return Ok(false) };
        let body = self.records.body();
        let brought = if opcode == op::CHUNK {
            chunk(body).map(|place| {
                self.place = place;
                None
            })
        } else {
            self.content.record(opcode, body)
        };
        self.single = brought.map_err(|what| self.records.damaged(what))?;
        Ok(true)
    }

    /// Returns the next record of the chunk.
    fn next_in_chunk(&mut self) -> Result<Option<Frame>, Corruption> {
        let chunk = self.records.body().get(self.place.clone()).unwrap_or_default();
        let mut bytes = Bytes(chunk);
        let malformed = Corruption::Malformed("chunk");
        let (Some(opcode), Some(length)) = (bytes.u8(), bytes.u64()) else {
            return Err(malformed);
        };
        let body = usize::try_from(length).ok().and_then(|length| bytes.take(length));
        let Some(body) = body else { return Err(malformed) };
        self.place.start = self.place.end - bytes.0.len();
        self.content.record(opcode, body)
    }
}

/// Returns the position of the records of a chunk if its CRC matches.
fn chunk(body: &[u8]) -> Result<Range<usize>, Corruption> {
    let mut bytes = Bytes(body);
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
        let mut next = self.pending.take();
        while capacity(batch) > 0 {
            let read = next.take().map_or_else(|| self.read_frame(), |frame| Ok(Some(frame)));
            match read {
                Ok(Some(frame)) if self.content.missing > 0 && batch.len() > before => {
                    self.pending = Some(frame);
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
