//! Error when a line is not a valid request.

use crate::live::recording::CaptureError;
use crate::window::NoteError;

/// Maximum length of a request line, including its newline \[bytes\].
pub const MAX_REQUEST: usize = 512;

/// Valid request lines, shown in errors.
const VALID_REQUESTS: &str = "window begin|end|identify, capture start [NAME]|stop, note {…}, \
    baseline set [N]|clear, reload";

/// Error when a line is not a valid request. Write one of the listed requests.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RequestError {
    /// The command is unknown.
    #[error("unknown command; known: {VALID_REQUESTS}")]
    Unknown,
    /// The line is longer than [`MAX_REQUEST`], or has no end.
    #[error("a command is one line of at most {MAX_REQUEST} bytes, its newline included")]
    NoLine,
    /// The name is not a valid capture name.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The note is invalid.
    #[error(transparent)]
    Note(#[from] NoteError),
    /// The line is not text.
    #[error("a command is UTF-8 text without control characters")]
    NotText,
}
