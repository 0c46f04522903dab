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
        /// Path of the recording.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Reading or repairing the file failed.
    #[error("{path}, byte {offset}: cannot read further: {source}", path = path.display())]
    Read {
        /// Path of the recording.
        path: PathBuf,
        /// Offset of the record's first byte in the file.
        offset: u64,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The file does not begin like a recording. Name a recording of this program.
    #[error("{path} is not an MCAP file: it does not begin like one", path = path.display())]
    NotMcap {
        /// Path of the recording.
        path: PathBuf,
    },
    /// A record is damaged.
    #[error("{path}, byte {offset}: {what}", path = path.display())]
    Damaged {
        /// Path of the recording.
        path: PathBuf,
        /// Offset of the record in the file, or for a message the offset of its chunk \[bytes\].
        offset: u64,
        /// Kind of damage.
        what: Corruption,
    },
}

impl McapError {
    /// Returns true if the data after the error can still be read. The rest of a damaged chunk is
    /// skipped.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Damaged { what, .. } if what.is_in_chunk())
    }
}

/// Kind of damage of a record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Corruption {
    /// No record has this opcode or this length, so the following records cannot be found.
    #[error(
        "no record has opcode 0x{opcode:02X} and {length} bytes: the file is damaged from here on; \
         cut it here"
    )]
    Record {
        /// Opcode of the record.
        opcode: u8,
        /// Length that the record declares \[bytes\].
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
    /// A message contains a frame that cannot exist.
    #[error("no frame: {0}")]
    Impossible(#[from] FrameError),
    /// The topic of a channel does not name an interface.
    #[error(
        "the topic `{0}` names no interface: expected /can/ and a name of at most 15 characters"
    )]
    Topic(String),
    /// The file has more interfaces than a source can have.
    #[error("more than {MAX_INTERFACES} interfaces in one recording")]
    TooManyInterfaces,
}

impl Corruption {
    fn is_in_chunk(&self) -> bool {
        !matches!(self, Self::Record { .. })
    }
}
