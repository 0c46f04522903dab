//! What a table of whatever kind is asked for: its header, and the numbers of some columns.

use super::error::TableError;
use super::header::Column;
use super::place::Place;
use super::time::Exact;
use crate::room::Room;

/// A table that is open behind its header.
pub(super) trait Source {
    /// The names of the columns.
    fn names(&self) -> &[String];

    /// Seconds to a 1 of a column whose type is one of times.
    fn second(&self, column: usize) -> Option<f64>;

    /// Where its first row stands.
    fn first_row(&self) -> Place;

    /// The numbers of the columns that are asked for.
    ///
    /// # Errors
    /// See [`TableError`]; [`TableError::NotANumber`] at the first field that is none.
    fn read(self: Box<Self>, columns: &[Column], room: Room) -> Result<Values, TableError>;
}

/// The numbers of a table, as they stand.
pub(super) struct Values {
    /// One entry per column of the file, empty where it is not asked for. Times are after the first, and
    /// what is empty or null is NaN.
    pub(super) columns: Vec<Vec<f64>>,
    /// What the last digit of the finest time is worth.
    pub(super) resolution: f64,
    /// The first time, after which they are; nothing where its clock is not named.
    pub(super) first: Option<Exact>,
}
