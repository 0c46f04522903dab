//! What is said beside the result.

use std::io::Write as _;

use super::progress::Beside;

/// Writes to stderr. Whether that is closed or full is of no account: what is said there decides nothing.
pub(super) fn tell(text: &str) {
    let _ = Beside.write_all(text.as_bytes());
}
