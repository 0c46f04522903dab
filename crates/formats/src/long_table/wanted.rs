//! Requested columns of a table, row by row, with every field as text.

use super::error::LongTableError;

/// Requested columns of a table, and the function that takes their rows.
pub(super) struct RequestedColumns<'a, const N: usize> {
    names: [&'a str; N],
    /// Index of each requested column in the table.
    column_indices: [usize; N],
    take: &'a mut dyn FnMut([String; N]),
}

impl<'a, const N: usize> RequestedColumns<'a, N> {
    pub(super) fn new(names: [&'a str; N], take: &'a mut dyn FnMut([String; N])) -> Self {
        Self { names, column_indices: [0; N], take }
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

    /// Takes the fields of a row.
    pub(super) fn take_row(&mut self, mut fields: Vec<String>) {
        let field = |place: usize| fields.get_mut(place).map(core::mem::take).unwrap_or_default();
        (self.take)(self.column_indices.map(field));
    }
}
