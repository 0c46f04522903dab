//! A table before its conversion to text.

use didim::text::significant_digits;

/// Table before its conversion to text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Heading of the table.
    pub title: String,
    /// Explanation for the reader.
    pub note: String,
    /// One heading per column.
    pub header: Vec<String>,
    /// The rows; the first cell of a row is the name of the row.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// Text of the cell.
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
    /// Returns the cell for a missing value.
    pub(super) fn missing() -> Self {
        Self::from("–")
    }
}

/// Formats a number with `digits` significant digits. Returns a dash for a value that is not
/// finite.
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
