//! Errors of a recording and their remedies.

use std::path::PathBuf;

use crate::frame::FrameError;
use crate::source::MAX_INTERFACES;

/// Reason why a recording could not be read.
#[derive(Debug, thiserror::Error)]
pub enum McapError {
    /// The file cannot be opened: check the path and its permissions.
    #[error(
        "cannot open the recording {path}: {source}; check the path and the permissions",
        path = path.display()
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Reading or repairing failed.
    #[error("{path}, byte {offset}: cannot read further: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Offset of the record's first byte.
        offset: u64,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The file does not begin like a recording. Name a recording of this program.
    #[error("{path} is not an MCAP file: it does not begin like one", path = path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// A record is damaged.
    #[error("{path}, byte {offset}: {what}", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Offset of the record in the file; for a message, that of its chunk.
        offset: u64,
        /// The corruption.
        what: Corruption,
    },
}

impl McapError {
    /// Returns true if the following data can still be read: the rest of a damaged chunk is
    /// skipped.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Damaged { what, .. } if what.is_in_chunk())
    }
}

/// Kind of damage of a record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Corruption {
    /// No record has this opcode or this length: the following records cannot be found.
    #[error(
        "no record has opcode 0x{opcode:02X} and {length} bytes: the file is damaged from here on; \
         cut it here"
    )]
    Record {
        /// The opcode.
        opcode: u8,
        /// Declared length \[bytes\].
        length: u64,
    },
    /// The CRC of a chunk does not match.
    #[error("the CRC of the chunk does not match: its frames are not used; copy the file again")]
    Crc,
    /// A chunk is compressed.
    #[error("the chunk is compressed ({0}): write it anew with `mcap compress --compression none`")]
    Compressed(String),
    /// The fields of a record contradict each other.
    #[error("the {0} is malformed: its chunk is not used; copy the file again")]
    Malformed(&'static str),
    /// Such a frame cannot exist.
    #[error("no frame: {0}")]
    Impossible(#[from] FrameError),
    /// The topic names no interface.
    #[error(
        "the topic `{0}` names no interface: expected /can/ and a name of at most 15 characters"
    )]
    Topic(String),
    /// More interfaces than a source can have.
    #[error("more than {MAX_INTERFACES} interfaces in one recording")]
    TooManyInterfaces,
}

impl Corruption {
    fn is_in_chunk(&self) -> bool {
        !matches!(self, Self::Record { .. })
    }
}
