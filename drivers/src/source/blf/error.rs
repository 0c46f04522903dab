//! Errors of a binary log and their remedies.

use std::io;
use std::path::PathBuf;

use crate::frame::FrameError;
use crate::source::MAX_INTERFACES;

/// Reason why a binary log cannot be read. Reading cannot continue after an error.
#[derive(Debug, thiserror::Error)]
pub enum BlfError {
    /// The file cannot be opened: check the path and its permissions.
    #[error(
        "cannot open the log {path}: {source}; check the path and the permissions",
        path = path.display()
    )]
    Open {
        /// Path of the log.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Reading the file failed.
    #[error("{path}, byte {offset}: cannot read further: {source}", path = path.display())]
    Read {
        /// Path of the log.
        path: PathBuf,
        /// Offset of the object in the file \[bytes\].
        offset: u64,
        /// Error of the system.
        source: io::Error,
    },
    /// The content of an object contradicts its header.
    #[error(
        "{path}, byte {offset}: {fault}; the log is damaged there: write it anew",
        path = path.display()
    )]
    Damaged {
        /// Path of the log.
        path: PathBuf,
        /// Offset of the object, or of its container, in the file \[bytes\].
        offset: u64,
        /// Fault of the object.
        fault: ObjectFault,
    },
}

/// Fault of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObjectFault {
    /// The file does not begin as a binary log.
    #[error("no header of a binary log (BLF)")]
    Header,
    /// No object begins at its place.
    #[error("no object begins there")]
    Mark,
    /// The length of an object is impossible.
    #[error("the length of an object is impossible")]
    Length,
    /// A container cannot be decompressed.
    #[error("a container cannot be decompressed")]
    Compression,
    /// A frame has no channel that can be an interface.
    #[error("a frame has an impossible channel")]
    Channel,
    /// The log has more channels than a source can have interfaces.
    #[error("more than {MAX_INTERFACES} channels: name those to read")]
    TooManyInterfaces,
    /// An object describes a frame that cannot exist.
    #[error(transparent)]
    Impossible(#[from] FrameError),
}
