//! A recording as a source: read as fast as it is asked for, in bounded memory.

use core::ops::Range;
use core::time::Duration;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::bytes::{Bytes, ChunkHead};
use super::content::Content;
use super::error::{Damage, McapError};
use super::info::McapInfo;
use super::op;
use super::records::{FileEnd, Records};
use crate::frame::Frame;
use crate::source::{
    InterfaceName, Received, Source, SourceCounters, SourceError, StampClock, room,
};

/// Frames of an MCAP file, in the order in which they were recorded.
///
/// It never waits and is never silent. Messages that are no frames are passed over and counted.
#[derive(Debug)]
pub struct McapSource<R = BufReader<File>> {
    records: Records<R>,
    content: Content,
    /// The records of the chunk in memory that are still to be read.
    place: Range<usize>,
    /// A message outside of any chunk.
    single: Option<Frame>,
    /// Handed out by the next call: frames are missing before it, and not before those of this one.
    held: Option<Frame>,
    /// Reported by the next call, after the frames before it.
    failure: Option<McapError>,
}

impl McapSource {
    /// Opens a recording, as [`TextLog::open`](crate::source::TextLog::open) a log: with
    /// names, frames of other interfaces are passed over and counted.
    ///
    /// # Errors
    /// [`McapError`]: it cannot be opened, is no MCAP file, or begins with damage.
    pub fn open(path: &Path, interfaces: &[InterfaceName]) -> Result<Self, McapError> {
        match File::open(path) {
            Ok(file) => Self::new(BufReader::new(file), path, interfaces),
            Err(source) => Err(McapError::Open { path: path.into(), source }),
        }
    }
}

impl<R: Read> McapSource<R> {
    /// Reads a recording from anything; `path` is what errors call it. As [`McapSource::open`].
    ///
    /// # Errors
    /// As [`McapSource::open`].
    pub fn new(reader: R, path: &Path, interfaces: &[InterfaceName]) -> Result<Self, McapError> {
        let mut source = Self {
            records: Records::new(reader, path)?,
            content: Content::new(interfaces),
            place: 0..0,
            single: None,
            held: None,
            failure: None,
        };
        // What stands before the first frame tells the interfaces and the time.
        while source.place.is_empty() && source.single.is_none() && source.load()? {}
        Ok(source)
    }

    /// What the file says about itself; nothing when it is another program's.
    pub fn info(&self) -> Option<&McapInfo> {
        self.content.info()
    }

    /// How the file ends; nothing before its end was reached.
    pub fn ending(&self) -> Option<FileEnd> {
        self.records.end()
    }

    /// The sequence of the last frame, for the file that continues this one.
    pub fn last_sequence(&self) -> Option<u32> {
        self.content.sequence
    }

    /// Counts what is missing since this sequence, that of the last frame of the file before.
    pub fn continue_from(&mut self, sequence: Option<u32>) {
        self.content.sequence = sequence;
    }

    /// The next frame; nothing at the end.
    ///
    /// # Errors
    /// [`McapError`]; [`McapError::is_recoverable`] tells whether to call again.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, McapError> {
        let next = match self.held.take() {
            Some(frame) => Ok(Some(frame)),
            None => self.read_frame(),
        };
        self.count_missing();
        next
    }

    fn count_missing(&mut self) {
        self.content.counters.queue_drops += core::mem::take(&mut self.content.missing);
    }

    /// The next frame; what is missing before it is not counted yet.
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

    /// Reads the next record; false at the end.
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

    /// The next record of the chunk.
    fn next_in_chunk(&mut self) -> Result<Option<Frame>, Damage> {
        let chunk = self.records.body().get(self.place.clone()).unwrap_or_default();
        let mut bytes = Bytes(chunk);
        let malformed = Damage::Malformed("chunk");
        let (Some(opcode), Some(length)) = (bytes.u8(), bytes.u64()) else {
            return Err(malformed);
        };
        let body = usize::try_from(length).ok().and_then(|length| bytes.take(length));
        let Some(body) = body else { return Err(malformed) };
        self.place.start = self.place.end - bytes.0.len();
        self.content.record(opcode, body)
    }
}

/// Where the records of a chunk are, if its CRC is theirs.
fn chunk(body: &[u8]) -> Result<Range<usize>, Damage> {
    let mut bytes = Bytes(body);
    let head = ChunkHead::read(&mut bytes).ok_or(Damage::Malformed("chunk"))?;
    if !head.compression.is_empty() {
        return Err(Damage::Compressed(head.compression.chars().take(16).collect()));
    }
    let start = body.len() - bytes.0.len();
    let records = usize::try_from(head.length).ok().and_then(|length| bytes.take(length));
    let records = records.ok_or(Damage::Malformed("chunk"))?;
    // 0 says that there is none.
    if head.crc != 0 && head.crc != crc32fast::hash(records) {
        return Err(Damage::Crc);
    }
    Ok(start..start + records.len())
}

impl<R: Read + Send> Source for McapSource<R> {
    fn receive(&mut self, batch: &mut Vec<Frame>, _: Duration) -> Result<Received, SourceError> {
        if room(batch) == 0 {
            return Err(SourceError::NoRoom);
        }
        if let Some(failure) = self.failure.take() {
            return Err(failure.into());
        }
        let before = batch.len();
        let mut next = self.held.take();
        while room(batch) > 0 {
            let read = next.take().map_or_else(|| self.read_frame(), |frame| Ok(Some(frame)));
            match read {
                Ok(Some(frame)) if self.content.missing > 0 && batch.len() > before => {
                    self.held = Some(frame);
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
