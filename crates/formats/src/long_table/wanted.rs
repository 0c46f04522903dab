//! Requested columns of a table, row by row, with every field as text.

use super::error::LongTableError;

/// Largest number of rows: ten thousand results of a hundred parameters.
const MOST_ROWS: usize = 1_000_000;

/// Requested columns of a table and their rows so far.
pub(super) struct RequestedColumns<'a, const N: usize> {
    names: [&'a str; N],
    /// Index of each requested column in the table.
    column_indices: [usize; N],
    pub(super) rows: Vec<[String; N]>,
}

impl<'a, const N: usize> RequestedColumns<'a, N> {
    pub(super) fn new(names: [&'a str; N]) -> Self {
        Self { names, column_indices: [0; N], rows: Vec::new() }
    }

    /// Finds the columns in the header.
    pub(super) fn find(&mut self, header: &[&str]) -> Result<(), LongTableError> {
        for (place, name) in self.column_indices.iter_mut().zip(self.names) {
            let position = header.iter().position(|own| *own == name);
            *place =
                position.ok_or_else(|| LongTableError::NoColumn { column: name.to_owned() })?;
        }
        Ok(())
    }

    /// Adds the fields of a row.
    pub(super) fn take_row(&mut self, mut fields: Vec<String>) -> Result<(), LongTableError> {
        if self.rows.len() == MOST_ROWS {
            return Err(LongTableError::TooLong { most: MOST_ROWS });
        }
        let field = |place: usize| fields.get_mut(place).map(core::mem::take).unwrap_or_default();
        self.rows.push(self.column_indices.map(field));
        Ok(())
    }
}
