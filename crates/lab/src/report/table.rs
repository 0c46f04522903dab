//! A table before its conversion to text.

use didim::text::significant_digits;

/// Table before its conversion to text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Its heading.
    pub title: String,
    /// Explanation for the reader.
    pub note: String,
    /// One heading per column.
    pub header: Vec<String>,
    /// The rows; the first cell of each is its name.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// Its text.
    pub text: String,
    /// True if the cell is marked.
    pub is_marked: bool,
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { text, is_marked: false }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::from(text.to_owned())
    }
}

impl Cell {
    /// A missing value.
    pub(super) fn missing() -> Self {
        Self::from("–")
    }
}

/// Formats a number with `digits` significant digits; a dash for a value that is not a number.
pub(super) fn number_text(value: f64, digits: usize) -> String {
    if value.is_finite() { significant_digits(value, digits) } else { "–".to_owned() }
}

pub(super) fn percent_text(share: f64, digits: usize) -> String {
    if share.is_finite() {
        format!("{} %", number_text(100.0 * share, digits))
    } else {
        "–".to_owned()
    }
}
