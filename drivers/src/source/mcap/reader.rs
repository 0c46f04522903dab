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
use super::records::{FileEnd, Records};
use super::{MAX_RECORD, op};
use crate::frame::Frame;
use crate::source::{
    InterfaceName, Received, Source, SourceCounters, SourceError, StampClock, capacity,
};

/// Source of the frames of an MCAP file, in the order of the recording.
///
/// A call never waits and never returns [`Received::Silence`](crate::source::Received::Silence).
/// Messages that are not frames are skipped and counted.
#[derive(Debug)]
pub struct McapSource<R = BufReader<File>> {
    records: Records<R>,
    content: FileContent,
    /// Range of the unread records in the chunk that is in memory.
    unread_range: Range<usize>,
    /// Records of a compressed chunk; empty if the chunk is not compressed.
    decompressed: Vec<u8>,
    /// Frame of a message outside of any chunk.
    unchunked_frame: Option<Frame>,
    /// Frame that the next call returns. Frames are missing before it, and no frames are missing
    /// before the frames of this call.
    next_frame: Option<Frame>,
    /// Error that the next call returns, after the frames that precede it.
    failure: Option<McapError>,
}

impl McapSource {
    /// Opens a recording. If `interfaces` is not empty, frames of other interfaces are skipped and
    /// counted, as by [`TextLog::open`](crate::source::TextLog::open).
    ///
    /// # Errors
    /// [`McapError`] if the file cannot be opened, is not an MCAP file, or is damaged at its
    /// beginning.
    pub fn open(path: &Path, interfaces: &[InterfaceName]) -> Result<Self, McapError> {
        match File::open(path) {
            Ok(file) => Self::new(BufReader::new(file), path, interfaces),
            Err(source) => Err(McapError::Open { path: path.into(), source }),
        }
    }
}

impl<R: Read> McapSource<R> {
    /// Reads a recording from any reader, like [`McapSource::open`]. Errors name the recording
    /// `path`.
    ///
    /// # Errors
    /// [`McapError`] as for [`McapSource::open`].
    pub fn new(reader: R, path: &Path, interfaces: &[InterfaceName]) -> Result<Self, McapError> {
        let mut source = Self {
            records: Records::new(reader, path)?,
            content: FileContent::new(interfaces),
            unread_range: 0..0,
            decompressed: Vec::new(),
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

    /// Returns the description in the file, or `None` if another program wrote the file.
    pub fn info(&self) -> Option<&McapInfo> {
        self.content.info()
    }

    /// Returns the kind of the file's end, or `None` before the reader has reached the end.
    pub fn file_end(&self) -> Option<FileEnd> {
        self.records.end()
    }

    /// Returns the sequence number of the last frame. The file that continues this one needs it.
    pub fn last_sequence(&self) -> Option<u32> {
        self.content.sequence
    }

    /// Sets the sequence number of the last frame of the previous file. Missing frames are counted
    /// from it on.
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

    /// Returns the next frame. Missing frames before it are not counted yet.
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

    /// Reads the next record of the file. Returns false at the end.
    fn load_chunk(&mut self) -> Result<bool, McapError> {
        let Some(opcode) = self.records.advance()? else { return Ok(false) };
        let body = self.records.last_body();
        let brought = if opcode == op::CHUNK {
            chunk_records(body, &mut self.decompressed).map(|place| {
                self.unread_range = place;
                None
            })
        } else {
            self.content.handle_record(opcode, body)
        };
        self.unchunked_frame = brought.map_err(|what| self.records.corruption_error(what))?;
        Ok(true)
    }

    /// Reads the next record of the chunk. Returns a frame if the record contains one.
    fn next_in_chunk(&mut self) -> Result<Option<Frame>, Corruption> {
        let chunk = match self.decompressed.is_empty() {
            true => self.records.last_body(),
            false => &self.decompressed,
        };
        let chunk = chunk.get(self.unread_range.clone()).unwrap_or_default();
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

/// Returns the range of the records in a chunk, after a check of their CRC. Records that are
/// compressed are in `decompressed`, which is empty otherwise.
fn chunk_records(body: &[u8], decompressed: &mut Vec<u8>) -> Result<Range<usize>, Corruption> {
    decompressed.clear();
    let mut bytes = ByteReader(body);
    let head = ChunkHead::read(&mut bytes).ok_or(Corruption::Malformed("chunk"))?;
    let start = body.len() - bytes.0.len();
    let stored = usize::try_from(head.length).ok().and_then(|length| bytes.take(length));
    let stored = stored.ok_or(Corruption::Malformed("chunk"))?;
    let (records, start) = match head.compression {
        "" => (stored, start),
        _ => {
            decompress(&head, stored, decompressed)?;
            (&decompressed[..], 0)
        }
    };
    // A CRC of 0 means that the chunk has no CRC.
    if head.crc != 0 && head.crc != crc32fast::hash(records) {
        return Err(Corruption::Crc);
    }
    Ok(start..start + records.len())
}

/// Decompresses the records of a chunk, up to their declared size.
fn decompress(
    head: &ChunkHead<'_>,
    stored: &[u8],
    records: &mut Vec<u8>,
) -> Result<(), Corruption> {
    if head.uncompressed > MAX_RECORD {
        return Err(Corruption::Record { opcode: op::CHUNK, length: head.uncompressed });
    }
    let limit = head.uncompressed + 1;
    let read = match head.compression {
        "zstd" => ruzstd::decoding::StreamingDecoder::new(stored)
            .map_err(std::io::Error::other)
            .and_then(|decoder| decoder.take(limit).read_to_end(records)),
        "lz4" => lz4_flex::frame::FrameDecoder::new(stored).take(limit).read_to_end(records),
        other => return Err(Corruption::Compressed(other.chars().take(16).collect())),
    };
    match read {
        Ok(length) if length as u64 == head.uncompressed => Ok(()),
        _ => Err(Corruption::Malformed("chunk")),
    }
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
