//! A table before it is text.

use crate::text::significant;

/// A table before it is text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Its heading.
    pub title: String,
    /// How to read it.
    pub note: String,
    /// One for each column.
    pub header: Vec<String>,
    /// The rows; the first cell of each is its name.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// Its text.
    pub text: String,
    /// Whether it is marked.
    pub marked: bool,
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { text, marked: false }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::from(text.to_owned())
    }
}

impl Cell {
    /// A missing value.
    pub(super) fn none() -> Self {
        Self::from("–")
    }
}

/// A number with so many significant digits; a dash for what is none.
pub(super) fn number(value: f64, digits: usize) -> String {
    if value.is_finite() { significant(value, digits) } else { "–".to_owned() }
}

pub(super) fn percent(share: f64, digits: usize) -> String {
    if share.is_finite() {
        format!("{} %", number(100.0 * share, digits))
    } else {
        "–".to_owned()
    }
}
