//! Text with data: numbers with their digits, aligned tables, digests.

mod digest;
mod table;

pub use digest::{hexadecimal, is_digest, sha256};
pub use table::{aligned, significant, to_uncertainty};

/// Escapes text for XML and HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
