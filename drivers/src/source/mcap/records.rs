//! Records of a file, one after the other, in bounded memory.

use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::error::{Corruption, McapError};
use super::{MAGIC, MAX_RECORD, op};

/// Initial capacity for records \[bytes\]. It is larger than the chunks of this program, so that
/// reading them allocates nothing.
const RECORD_CAPACITY: usize = 1 << 20;

/// State of the end of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileEnd {
    /// The writer closed the file.
    Finished,
    /// The file is truncated. The bytes after the last complete record are not used.
    Unfinished {
        /// Number of bytes after the last complete record.
        unused_bytes: u64,
    },
}

/// Reader of the records of a file, one after the other.
#[derive(Debug)]
pub(super) struct Records<R> {
    reader: R,
    path: PathBuf,
    /// Offset of the next record in the file \[bytes\].
    next_offset: u64,
    /// Offset of the last record in the file \[bytes\].
    offset: u64,
    body: Vec<u8>,
    file_end: Option<FileEnd>,
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
        let body = Vec::with_capacity(RECORD_CAPACITY);
        let next = MAGIC.len() as u64;
        Ok(Self {
            reader,
            path: path.into(),
            next_offset: next,
            offset: next,
            body,
            file_end: None,
        })
    }

    /// Reads the next relevant record into memory. Returns its opcode, or `None` at the end. After
    /// an error no further record is returned.
    pub(super) fn advance(&mut self) -> Result<Option<u8>, McapError> {
        while self.file_end.is_none() {
            self.offset = self.next_offset;
            let result = self.read_record();
            match result {
                Ok(Some((op::DATA_END | op::FOOTER, _))) => self.file_end = Some(FileEnd::Finished),
                Ok(Some((opcode, true))) => return Ok(Some(opcode)),
                Ok(Some((_, false))) => {}
                Ok(None) => {}
                Err(error) => {
                    self.file_end = Some(FileEnd::Unfinished { unused_bytes: 0 });
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
        let read_length = read_up_to(&mut self.reader, &mut head).map_err(read)?;
        if read_length < head.len() {
            self.file_end = Some(FileEnd::Unfinished { unused_bytes: read_length as u64 });
            return Ok(None);
        }
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let is_used =
            matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::METADATA);
        // Attachments and records of later versions are skipped, regardless of their length.
        if opcode == 0 || (is_used && length > MAX_RECORD) {
            return Err(self.corruption_error(Corruption::Record { opcode, length }));
        }
        self.body.clear();
        let mut limited = self.reader.by_ref().take(length);
        let body = if is_used {
            // The memory grows with the data that are available, not with the declared length.
            limited.read_to_end(&mut self.body).map(|found| found as u64)
        } else {
            io::copy(&mut limited, &mut io::sink())
        };
        let body = body.map_err(|source| McapError::Read {
            path: self.path.clone(),
            offset: self.offset,
            source,
        })?;
        if body < length {
            let unused_bytes = body + head.len() as u64;
            self.file_end = Some(FileEnd::Unfinished { unused_bytes });
            return Ok(None);
        }
        self.next_offset = self.offset + head.len() as u64 + length;
        Ok(Some((opcode, is_used)))
    }

    /// Returns the content of the last record.
    pub(super) fn last_body(&self) -> &[u8] {
        &self.body
    }

    /// Returns the state of the file's end, or `None` before it is known.
    pub(super) fn end(&self) -> Option<FileEnd> {
        self.file_end
    }

    /// Returns the error for damage in the last record.
    pub(super) fn corruption_error(&self, what: Corruption) -> McapError {
        McapError::Damaged { path: self.path.clone(), offset: self.offset, what }
    }
}

/// Fills the buffer as far as bytes are available, and returns their number.
fn read_up_to(reader: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match reader.read(rest) {
            Ok(0) => break,
            Ok(more) => filled += more,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
