//! Why a line is no request.

use crate::live::recording::CaptureError;
use crate::window::NoteError;

/// The longest line of a request, its newline included \[bytes\].
pub const MAX_REQUEST: usize = 512;

/// The lines that are requests, for who wrote another.
const KNOWN: &str = "window begin|end|identify, capture start [NAME]|stop, note {…}, baseline set [N]|clear, reload";

/// A line that is no request: write one of those that it names.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RequestError {
    /// The command is not known.
    #[error("unknown command; known: {KNOWN}")]
    Unknown,
    /// It is longer than [`MAX_REQUEST`], or has no end.
    #[error("a command is one line of at most {MAX_REQUEST} bytes, its newline included")]
    NoLine,
    /// The name of a capture is none.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The note is invalid.
    #[error(transparent)]
    Note(#[from] NoteError),
    /// It is not text.
    #[error("a command is UTF-8 text without control characters")]
    NotText,
}
