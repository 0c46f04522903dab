//! Interface of a table of either kind: its header, and the numbers of some columns.

use super::column::Column;
use super::error::TableError;
use super::place::RowPlace;
use super::time::ExactTime;
use crate::capacity::Capacity;

/// An open table whose header has been read.
pub(super) trait Source {
    /// Returns the names of the columns.
    fn names(&self) -> &[String];

    /// Returns the unit of each column, from a row of units; empty without one.
    fn units(&self) -> &[String] {
        &[]
    }

    /// Returns the texts of the first row, by column; empty if the file has types.
    fn first_row_texts(&self) -> &[String] {
        &[]
    }

    /// Looks for texts in the first rows, before the rows are read.
    fn find_texts(&mut self) {}

    /// Returns true for a column that cannot be a signal: it has texts and no numbers, as far as
    /// the first rows show, or neither a name nor values.
    fn has_text(&self, column: usize) -> bool;

    /// Returns false if the columns have numbers from 1 as names.
    fn has_header(&self) -> bool {
        true
    }

    /// Returns the seconds in a unit of a column whose type is a time.
    fn seconds_per_unit(&self, column: usize) -> Option<f64>;

    /// Returns the place of its first row.
    fn first_row(&self) -> RowPlace;

    /// Reads the numbers of the wanted columns.
    ///
    /// # Errors
    /// See [`TableError`]; [`TableError::NotANumber`] at the first field that is none.
    fn read(
        self: Box<Self>,
        columns: &[Column],
        capacity: Capacity,
    ) -> Result<TableValues, TableError>;
}

/// Numbers of a table, unscaled.
pub(super) struct TableValues {
    /// One entry per column of the file, empty if it is not wanted. Times count from the first, and
    /// empty fields and nulls are NaN.
    pub(super) columns: Vec<Vec<f64>>,
    /// Value of the last digit of the finest time.
    pub(super) resolution: f64,
    /// The first time, from which the others count; `None` if its clock is unknown.
    pub(super) first_time: Option<ExactTime>,
    /// Rows, from 0, at which another recording begins, by a header within the rows.
    pub(super) begins: Vec<usize>,
}

impl TableValues {
    /// Creates the values of a table without rows.
    pub(super) fn new(columns: usize) -> Self {
        Self {
            columns: vec![Vec::new(); columns],
            resolution: f64::INFINITY,
            first_time: None,
            begins: Vec::new(),
        }
    }
}
