//! Content of a table's column.

use crate::columns::Quantity;

/// Content of one column of the file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Column {
    /// The time in numbers.
    Time,
    /// The time in dates.
    Date,
    /// Whole seconds of the time.
    Seconds,
    /// Nanoseconds beyond them.
    Nanoseconds,
    Signal(Quantity, usize),
    /// A column that is not requested.
    Other,
}

impl Column {
    /// Returns true for a column with the complete time.
    pub(super) fn is_time(&self) -> bool {
        matches!(self, Self::Time | Self::Date)
    }
}
