//! Summary of a file, read from the heads of its records. The scan is fast because it reads nothing
//! else.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use super::bytes::{ByteReader, ChunkHead};
use super::error::McapError;
use super::info::McapInfo;
use super::records::FileEnd;
use super::{MAGIC, op};

/// Longest metadata record that is read \[bytes\].
const MAX_METADATA: u64 = 1 << 20;

/// Size of the head of a chunk, with the longest relevant name of a compression \[bytes\].
const CHUNK_HEAD_BYTES: u64 = 40 + 16;

/// Position and times of one chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkSpan {
    /// Offset of the chunk's record in the file \[bytes\].
    pub offset: u64,
    /// Offset of the first byte after the chunk \[bytes\].
    pub end_offset: u64,
    /// Earliest `log_time` in the chunk \[ns\].
    pub first_log_time: u64,
    /// Latest `log_time` in the chunk \[ns\].
    pub last_log_time: u64,
}

/// Summary of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct McapScan {
    /// Description in the file, if this program wrote it.
    pub info: Option<McapInfo>,
    /// Chunks of the file in their order. Their content was not checked.
    pub chunks: Vec<ChunkSpan>,
    /// State of the end of the file.
    pub file_end: FileEnd,
    /// Length of the file \[bytes\].
    pub bytes: u64,
}

impl McapScan {
    /// Scans a file.
    ///
    /// # Errors
    /// [`McapError::Open`], [`McapError::Read`] and [`McapError::NotMcap`].
    pub fn read(path: &Path) -> Result<Self, McapError> {
        let file =
            File::open(path).map_err(|source| McapError::Open { path: path.into(), source })?;
        let error_at = |offset| move |source| McapError::Read { path: path.into(), offset, source };
        let bytes = file.metadata().map_err(error_at(0))?.len();
        let mut reader = BufReader::with_capacity(256, file);
        let mut magic = [0; MAGIC.len()];
        if bytes < magic.len() as u64 {
            return Err(McapError::NotMcap { path: path.into() });
        }
        reader.read_exact(&mut magic).map_err(error_at(0))?;
        if magic != MAGIC {
            return Err(McapError::NotMcap { path: path.into() });
        }
        let unfinished = FileEnd::Unfinished { unused_bytes: 0 };
        let mut scan = Self { info: None, chunks: Vec::new(), file_end: unfinished, bytes };
        let mut offset = magic.len() as u64;
        let mut body = Vec::new();
        // Read complete records only. A length beyond the end of the file means that the record is
        // truncated, or that its length is damaged.
        while bytes - offset >= 9 {
            let mut head = [0; 9];
            reader.read_exact(&mut head).map_err(error_at(offset))?;
            let [opcode, length @ ..] = head;
            let length = u64::from_le_bytes(length);
            let end = (offset + 9).checked_add(length).filter(|end| *end <= bytes);
            let (Some(end), true) = (end, opcode != 0) else { break };
            let wanted = match opcode {
                op::DATA_END | op::FOOTER => {
                    scan.file_end = FileEnd::Finished;
                    return Ok(scan);
                }
                op::CHUNK => length.min(CHUNK_HEAD_BYTES),
                op::METADATA if scan.info.is_none() && length <= MAX_METADATA => length,
                _ => 0,
            };
            body.clear();
            reader.by_ref().take(wanted).read_to_end(&mut body).map_err(error_at(offset))?;
            if opcode == op::METADATA && wanted > 0 {
                scan.info = McapInfo::read(&body);
            }
            if opcode == op::CHUNK
                && let Some(head) = ChunkHead::read(&mut ByteReader(&body))
            {
                let (first_log_time, last_log_time) = (head.start, head.end);
                scan.chunks.push(ChunkSpan {
                    offset,
                    end_offset: end,
                    first_log_time,
                    last_log_time,
                });
            }
            reader.seek(SeekFrom::Start(end)).map_err(error_at(offset))?;
            offset = end;
        }
        scan.file_end = FileEnd::Unfinished { unused_bytes: bytes - offset };
        Ok(scan)
    }

    /// Returns the earliest and the latest stamp \[ns\], or `None` if the file has no frames of
    /// this program.
    pub fn stamps_ns(&self) -> Option<(u64, u64)> {
        let info = self.info.as_ref()?;
        let spans = self
            .chunks
            .iter()
            .map(|chunk| (info.stamp_ns(chunk.first_log_time), info.stamp_ns(chunk.last_log_time)));
        spans.reduce(|(first, last), (from, to)| (first.min(from), last.max(to)))
    }
}
