//! Source for a binary log. It reads at the speed of the caller, one container at a time.

use core::time::Duration;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};

use flate2::bufread::ZlibDecoder;

use super::error::{BlfError, ObjectFault};
use super::object::{self, CONTAINER, HEADER_BYTES, MARK, u16_at, u32_at, u64_at};
use crate::frame::Frame;
use crate::source::{
    InterfaceName, MAX_INTERFACES, Received, Source, SourceCounters, SourceError, StampClock,
    TooManyInterfaces, capacity, index_of,
};

/// First bytes of a binary log.
const MAGIC: [u8; 4] = *b"LOGG";
/// Length of the header of the file as far as it is used, and of the longest one \[bytes\].
const FILE_HEADER_BYTES: u32 = 24;
const MAX_FILE_HEADER_BYTES: u32 = 4096;
/// Longest object, compressed or not \[bytes\]. Tools write containers of 128 KiB.
const MAX_OBJECT_BYTES: u32 = 1 << 24;
/// Length of the header of an object, as it is read from a file \[bytes\].
const OBJECT_HEADER_BYTES: u32 = 16;
/// Number of bytes by which objects in a container can be padded.
const MAX_PADDING: usize = 3;
/// Fields of a container: its compression, and its length without it.
const CONTAINER_FIELDS: usize = 16;
const NO_COMPRESSION: u16 = 0;
const ZLIB: u16 = 2;

/// Source of the frames of a binary log, in the order of the file.
///
/// A call never waits. If the file ends inside an object, its recorder was killed: the source ends
/// with the last complete object.
#[derive(Debug)]
pub struct BlfSource<R = BufReader<File>> {
    reader: R,
    /// Path of the log, which every error names.
    path: PathBuf,
    /// Offset of the last object of the file \[bytes\], and of the end of what was read.
    offset: u64,
    end: u64,
    /// Objects that are not yet parsed, from `parsed` on.
    objects: Vec<u8>,
    parsed: usize,
    interfaces: Vec<InterfaceName>,
    has_fixed_interfaces: bool,
    is_unfinished: bool,
    failure: Option<BlfError>,
    has_ended: bool,
    counters: SourceCounters,
}

impl BlfSource {
    /// Returns true if a file begins as a binary log.
    pub fn is_one(path: &Path) -> bool {
        let mut first = [0; MAGIC.len()];
        let read = File::open(path).and_then(|mut file| file.read_exact(&mut first));
        read.is_ok() && first == MAGIC
    }

    /// Opens a log. If `interfaces` is not empty, frames of other interfaces are skipped and
    /// counted.
    ///
    /// # Errors
    /// [`BlfError::Open`], or [`BlfError::Damaged`] for another kind of file.
    pub fn open(path: &Path, interfaces: &[InterfaceName]) -> Result<Self, BlfError> {
        let open = |source| BlfError::Open { path: path.into(), source };
        let file = File::open(path).map_err(open)?;
        let length = file.metadata().map_err(open)?.len();
        Self::new(BufReader::new(file), length, path, interfaces)
    }
}

impl<R: BufRead> BlfSource<R> {
    /// Reads a log of `length` bytes from any reader, like [`BlfSource::open`].
    ///
    /// # Errors
    /// As [`BlfSource::open`].
    pub fn new(
        reader: R,
        length: u64,
        path: &Path,
        interfaces: &[InterfaceName],
    ) -> Result<Self, BlfError> {
        let mut interfaces_seen = Vec::with_capacity(MAX_INTERFACES.max(interfaces.len()));
        interfaces_seen.extend_from_slice(interfaces);
        let mut source = Self {
            reader,
            path: path.into(),
            offset: 0,
            end: 0,
            objects: Vec::new(),
            parsed: 0,
            interfaces: interfaces_seen,
            has_fixed_interfaces: !interfaces.is_empty(),
            is_unfinished: false,
            failure: None,
            has_ended: false,
            counters: SourceCounters::default(),
        };
        let header = source.read_bytes(FILE_HEADER_BYTES)?;
        let header_length = u32_at(&header, 4).filter(|_| header.starts_with(&MAGIC));
        let Some(rest) = header_length
            .filter(|length| *length <= MAX_FILE_HEADER_BYTES)
            .and_then(|length| length.checked_sub(FILE_HEADER_BYTES))
        else {
            return Err(source.damaged(ObjectFault::Header));
        };
        source.read_bytes(rest)?;
        // A recorder writes the length when it closes the file.
        source.is_unfinished = u64_at(&header, 16) != Some(length);
        Ok(source)
    }

    /// Returns true if the recorder did not close the file, or the file was cut off.
    pub fn is_unfinished(&self) -> bool {
        self.is_unfinished
    }

    /// Returns the next frame that is not skipped, or `None` at the end.
    fn next_frame(&mut self) -> Result<Option<Frame>, BlfError> {
        loop {
            while let Some((start, end)) = self.next_object()? {
                self.parsed = end;
                let object = self.objects.get(start..end).unwrap_or_default();
                let parsed = object::parse(object).map_err(|fault| self.damaged(fault))?;
                let Some((name, frame)) = parsed else { continue };
                match self.index_of(name)? {
                    Some(index) => return Ok(Some(frame.on_interface(index))),
                    None => self.counters.passed_over += 1,
                }
            }
            if !self.read_objects()? {
                return Ok(None);
            }
        }
    }

    /// Returns the place of the next complete object. Returns `None` if it is not complete yet.
    fn next_object(&self) -> Result<Option<(usize, usize)>, BlfError> {
        let rest = self.objects.get(self.parsed..).unwrap_or_default();
        // No frame is as short as this.
        if rest.len() < MAX_PADDING + HEADER_BYTES {
            return Ok(None);
        }
        let begins = |at: &usize| rest.get(*at..).is_some_and(|rest| rest.starts_with(&MARK));
        let padding = (0..=MAX_PADDING).find(begins);
        let padding = padding.ok_or_else(|| self.damaged(ObjectFault::Mark))?;
        let object = rest.get(padding..).unwrap_or_default();
        let length = u32_at(object, 8).filter(|length| *length <= MAX_OBJECT_BYTES);
        let length = length.and_then(|length| usize::try_from(length).ok());
        let length = length.filter(|length| *length >= HEADER_BYTES);
        let length = length.ok_or_else(|| self.damaged(ObjectFault::Length))?;
        let start = self.parsed + padding;
        Ok((length <= object.len()).then_some((start, start + length)))
    }

    /// Reads the next object of the file, and the objects in it if it is a container. Returns false
    /// at the end of the file, also inside an object.
    fn read_objects(&mut self) -> Result<bool, BlfError> {
        self.offset = self.end;
        let header = self.read_bytes(OBJECT_HEADER_BYTES)?;
        if header.len() < HEADER_BYTES {
            return Ok(false);
        }
        if !header.starts_with(&MARK) {
            return Err(self.damaged(ObjectFault::Mark));
        }
        let length = u32_at(&header, 8).filter(|length| *length <= MAX_OBJECT_BYTES);
        let content_length = length.and_then(|length| length.checked_sub(OBJECT_HEADER_BYTES));
        let content_length = content_length.ok_or_else(|| self.damaged(ObjectFault::Length))?;
        let content = self.read_bytes(content_length)?;
        if content.len() < content_length as usize {
            return Ok(false);
        }
        self.read_bytes(length.unwrap_or(0) % 4)?;
        self.objects.drain(..self.parsed);
        self.parsed = 0;
        if object::object_type(&header) == Some(CONTAINER) {
            self.append_container(&content)?;
        } else {
            self.objects.extend(header);
            self.objects.extend(content);
        }
        Ok(true)
    }

    /// Appends the objects of a container.
    fn append_container(&mut self, content: &[u8]) -> Result<(), BlfError> {
        let (compression, length) = (u16_at(content, 0), u32_at(content, 8));
        let data = content.get(CONTAINER_FIELDS..);
        let (Some(compression), Some(length), Some(data)) = (compression, length, data) else {
            return Err(self.damaged(ObjectFault::Length));
        };
        if length > MAX_OBJECT_BYTES {
            return Err(self.damaged(ObjectFault::Length));
        }
        let before = self.objects.len();
        let is_complete = match compression {
            NO_COMPRESSION => {
                self.objects.extend(data);
                true
            }
            ZLIB => {
                // One byte more shows a container that is longer than it says.
                let mut decoder = ZlibDecoder::new(data).take(u64::from(length) + 1);
                let read = decoder.read_to_end(&mut self.objects);
                read.is_ok() && self.objects.len() - before == length as usize
            }
            _ => false,
        };
        if is_complete { Ok(()) } else { Err(self.damaged(ObjectFault::Compression)) }
    }

    /// Reads up to `length` bytes; fewer at the end of the file.
    fn read_bytes(&mut self, length: u32) -> Result<Vec<u8>, BlfError> {
        let mut bytes = Vec::new();
        let read = self.reader.by_ref().take(length.into()).read_to_end(&mut bytes);
        read.map_err(|source| BlfError::Read {
            path: self.path.clone(),
            offset: self.end,
            source,
        })?;
        self.end += bytes.len() as u64;
        Ok(bytes)
    }

    fn index_of(&mut self, name: InterfaceName) -> Result<Option<u8>, BlfError> {
        index_of(&mut self.interfaces, name, self.has_fixed_interfaces)
            .map_err(|TooManyInterfaces| self.damaged(ObjectFault::TooManyInterfaces))
    }

    fn damaged(&self, fault: ObjectFault) -> BlfError {
        BlfError::Damaged { path: self.path.clone(), offset: self.offset, fault }
    }
}

impl<R: BufRead + Send> Source for BlfSource<R> {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        _timeout: Duration,
    ) -> Result<Received, SourceError> {
        if capacity(batch) == 0 {
            return Err(SourceError::NoRoom);
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
                Err(failure) => {
                    self.has_ended = true;
                    self.failure = Some(failure);
                }
            }
        }
        if batch.len() > before {
            return Ok(Received::Frames);
        }
        match self.failure.take() {
            Some(failure) => Err(failure.into()),
            None => Ok(Received::End),
        }
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
