//! Messages that are not part of the result.

use std::io::Write as _;

use super::progress::ProgressWriter;

/// Writes to stderr. A closed or full stderr is ignored, because nothing depends on these messages.
pub(super) fn print_note(text: &str) {
    let _ = ProgressWriter.write_all(text.as_bytes());
}
