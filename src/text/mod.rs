//! Text formatting of data: numbers with their digits, aligned tables, and digests.

mod digest;
mod table;

pub use digest::{is_digest, sha256, to_hexadecimal};
pub use table::{ColumnWidths, align_table, significant_digits, to_uncertainty};

/// Escapes text for XML and HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
