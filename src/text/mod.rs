//! Text formatting of data: numbers with their digits, aligned tables, and digests.

mod digest;
mod table;

pub use digest::{is_digest, sha256, to_hexadecimal};
pub use table::{ColumnWidths, align_table, significant_digits, to_uncertainty};

/// Largest number of names in a line. JSON has all of them.
const MAX_NAMES: usize = 3;

/// Lists the first names, and counts the others: `a, b, c and 25 more`.
pub fn few_listed(names: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let mut names = names.into_iter();
    let shown: Vec<String> =
        names.by_ref().take(MAX_NAMES).map(|name| name.as_ref().to_owned()).collect();
    match names.count() {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// Escapes text for XML and HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
