//! The records of a file, one after the other, in bounded memory.

use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::error::{Damage, McapError};
use super::{MAGIC, MAX_RECORD, op};

/// Memory for records that is there from the start: larger than the chunks that we write, so that
/// reading on takes no more.
const CAPACITY: usize = 1 << 20;

/// How a file ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileEnd {
    /// Whoever wrote it closed it.
    Finished,
    /// It was cut off. What is behind the last whole record is not used.
    Unfinished {
        /// Bytes behind the last whole record.
        unused_bytes: u64,
    },
}

/// Reads records.
#[derive(Debug)]
pub(super) struct Records<R> {
    reader: R,
    path: PathBuf,
    /// Where the next record begins.
    next: u64,
    /// Where the last one began.
    offset: u64,
    body: Vec<u8>,
    end: Option<FileEnd>,
}

impl<R: Read> Records<R> {
    pub(super) fn new(mut reader: R, path: &Path) -> Result<Self, McapError> {
        let mut magic = [0; MAGIC.len()];
        match reader.read_exact(&mut magic) {
            Ok(()) if magic == MAGIC => {}
            Err(source) if source.kind() != ErrorKind::UnexpectedEof => {
                return Err(McapError::Read { path: path.into(), offset: 0, source });
            }
            _ => return Err(McapError::NotMcap { path: path.into() }),
        }
        let body = Vec::with_capacity(CAPACITY);
        let next = MAGIC.len() as u64;
        Ok(Self { reader, path: path.into(), next, offset: next, body, end: None })
    }

    /// Reads the next record that matters into memory and tells its opcode; nothing at the end.
    /// After an error there is no more.
    pub(super) fn advance(&mut self) -> Result<Option<u8>, McapError> {
        while self.end.is_none() {
            self.offset = self.next;
            let result = self.read_record();
            match result {
                Ok(Some((op::DATA_END | op::FOOTER, _))) => self.end = Some(FileEnd::Finished),
                Ok(Some((opcode, true))) => return Ok(Some(opcode)),
                Ok(Some((_, false))) => {}
                Ok(None) => {}
                Err(error) => {
                    self.end = Some(FileEnd::Unfinished { unused_bytes: 0 });
                    return Err(error);
                }
            }
        }
        Ok(None)
    }

    fn read_record(&mut self) -> Result<Option<(u8, bool)>, McapError> {
        let read =
            |source| McapError::Read { path: self.path.clone(), offset: self.offset, source };
        let mut head = [0; 9];
        let found = read_up_to(&mut self.reader, &mut head).map_err(read)?;
        if found < head.len() {
            self.end = Some(FileEnd::Unfinished { unused_bytes: found as u64 });
            return Ok(None);
        }
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let kept =
            matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::METADATA);
        // Attachments and what a later version may know are passed over, however long.
        if opcode == 0 || (kept && length > MAX_RECORD) {
            return Err(self.damaged(Damage::Record { opcode, length }));
        }
        self.body.clear();
        let mut limited = self.reader.by_ref().take(length);
        let found = if kept {
            // Grows with what is there, whatever the length says.
            limited.read_to_end(&mut self.body).map(|found| found as u64)
        } else {
            io::copy(&mut limited, &mut io::sink())
        };
        let found = found.map_err(|source| McapError::Read {
            path: self.path.clone(),
            offset: self.offset,
            source,
        })?;
        if found < length {
            let unused_bytes = found + head.len() as u64;
            self.end = Some(FileEnd::Unfinished { unused_bytes });
            return Ok(None);
        }
        self.next = self.offset + head.len() as u64 + length;
        Ok(Some((opcode, kept)))
    }

    /// The record that was read last.
    pub(super) fn body(&self) -> &[u8] {
        &self.body
    }

    /// How the file ends; nothing before that is known.
    pub(super) fn end(&self) -> Option<FileEnd> {
        self.end
    }

    /// An error of the record that was read last.
    pub(super) fn damaged(&self, what: Damage) -> McapError {
        McapError::Damaged { path: self.path.clone(), offset: self.offset, what }
    }
}

/// Fills the buffer as far as there is something.
fn read_up_to(reader: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut found = 0;
    while let Some(rest) = buffer.get_mut(found..).filter(|rest| !rest.is_empty()) {
        match reader.read(rest) {
            Ok(0) => break,
            Ok(more) => found += more,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}
