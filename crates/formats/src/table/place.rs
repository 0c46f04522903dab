//! Place of a table's row, for people.

use core::fmt;

/// Place of a row in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowPlace {
    /// A line of text, the header being line 1.
    Line(u64),
    /// A row of a file without lines, from 1.
    Row(u64),
}

impl RowPlace {
    /// Returns the place this number of rows later, if each has its own line.
    pub(super) fn rows_later(self, rows: usize) -> Self {
        match self {
            Self::Line(line) => Self::Line(line + rows as u64),
            Self::Row(row) => Self::Row(row + rows as u64),
        }
    }
}

impl fmt::Display for RowPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}
