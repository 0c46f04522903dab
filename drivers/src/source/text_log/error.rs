//! Errors of a log and their remedies.

use std::path::PathBuf;

use crate::frame::FrameError;
use crate::source::MAX_INTERFACES;

/// Reason why a log could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TextLogError {
    /// The file cannot be opened: check the path and its permissions.
    #[error(
        "cannot open the log {path}: {source}; check the path and the permissions",
        path = path.display()
    )]
    Open {
        /// Path of the log.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Reading the file failed; the source ends there.
    #[error("{path}:{line}: cannot read further: {source}", path = path.display())]
    Read {
        /// Path of the log.
        path: PathBuf,
        /// Line at which reading failed, from 1.
        line: u64,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A line is not a frame. The next call skips it.
    #[error("{path}:{line}: {fault}", path = path.display())]
    Line {
        /// Path of the log.
        path: PathBuf,
        /// Line number, from 1.
        line: u64,
        /// Fault in the line.
        fault: LineFault,
    },
    /// The last line has no newline: the recording was truncated while it was written. Even a line
    /// that looks complete may lack bytes. Delete the line, or add the newline if the line is
    /// complete.
    #[error(
        "{path}:{line}: the last line has no newline: the log was cut off there; delete that line, \
         or end it with a newline if it is known to be whole",
        path = path.display()
    )]
    Truncated {
        /// Path of the log.
        path: PathBuf,
        /// Line number, from 1.
        line: u64,
    },
}

impl TextLogError {
    /// Returns true if the lines after the error can still be read.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Line { .. })
    }
}

/// Fault in a line of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineFault {
    /// The line is empty.
    #[error("the line is empty: delete it")]
    Empty,
    /// The line is longer than any frame.
    #[error(
        "the line is longer than any frame ({} bytes): this is not a candump log",
        super::MAX_LINE
    )]
    TooLong,
    /// The line has no stamp in parentheses.
    #[error(
        "no time stamp: a line starts with seconds and their fraction, as in \
         `(1436509052.249713)`; record with `candump -l` or `candump -L`"
    )]
    Stamp,
    /// The line is a row of a table.
    #[error(
        "this is a row of a table (CSV), not of a log of frames. Export the log as candump, ASC \
        (Vector) or TRC (PEAK), as SavvyCAN does with \"Save Log File\""
    )]
    Table,
    /// The stamp does not fit 64 bits of nanoseconds.
    #[error("the time stamp lies beyond the year 2554: correct the clock of the recorder")]
    StampRange,
    /// The time is not a number of seconds (ASC) or milliseconds (TRC).
    #[error("the line has no time that is a number: it is damaged or cut off")]
    Time,
    /// The identifier is not a number, or it is too large.
    #[error("the identifier is no number of 11 or 29 bits: the line is damaged")]
    LogId,
    /// The length or the kind of a frame is missing or unknown.
    #[error("kind or length of the frame are missing or not known: the line is damaged or cut off")]
    Length,
    /// The line has fewer data bytes than its length requires, or none.
    #[error("the line has not as many bytes of data as it says: it is damaged or cut off")]
    Bytes,
    /// The version of the log format is not supported.
    #[error("this version of TRC is not read; write it anew as 1.0 to 2.1")]
    Version,
    /// The line has no usable name of an interface.
    #[error(
        "no interface after the time stamp: expected a name of at most 15 characters, as in `can0`"
    )]
    Interface,
    /// The log has more interfaces than a source can have.
    #[error("more than {MAX_INTERFACES} interfaces in one log: name those to read")]
    TooManyInterfaces,
    /// The line has no `#` at the position of the frame.
    #[error("no frame after the interface: expected an identifier, `#` and data, as in `123#1122`")]
    Frame,
    /// The identifier is not three or eight hexadecimal digits.
    #[error("the identifier must be three hexadecimal digits (11 bits) or eight (29 bits)")]
    Id,
    /// The data are not pairs of hexadecimal digits.
    #[error("the data must be pairs of hexadecimal digits: the line is damaged or cut off")]
    Data,
    /// The flags of an FD frame are missing or unknown.
    #[error("after `##` one hexadecimal digit of flags must follow, at most 7")]
    FdFlags,
    /// The length of a remote request is not a digit from 0 to 8.
    #[error("a remote request is `R` or `R` and its length from 0 to 8")]
    RemoteLength,
    /// A raw data length code is at a position at which it is not allowed.
    #[error(
        "`_` and a data length code from 9 to F may only follow eight bytes of a classic frame"
    )]
    RawLengthCode,
    /// The identifier marks an error frame, but the line has the form of another kind of frame.
    #[error("an error frame (identifier from 20000000) can be neither CAN FD nor remote")]
    ErrorForm,
    /// The mark of the direction after the frame is neither `T` nor `R`.
    #[error("after the frame only `R` or `T` may follow: delete the rest of the line")]
    Direction,
    /// The line describes a frame that cannot exist.
    #[error(transparent)]
    Impossible(#[from] FrameError),
}
