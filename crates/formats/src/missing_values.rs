//! Rows and messages with a missing value: an empty field, null or NaN. They are not samples.

use core::fmt;

/// Rows or messages left out because they miss a value.
#[derive(Clone, Debug, PartialEq)]
pub struct MissingValues {
    /// Number of rows with missing values.
    pub missing: usize,
    /// Number of all rows.
    pub total: usize,
    /// `rows` or `messages`.
    pub row_kind: &'static str,
    /// Description of the first one.
    pub first_missing: String,
}

impl fmt::Display for MissingValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { missing, total: of, row_kind: what, first_missing: first } = self;
        write!(f, "{missing} of {of} {what} lack a value, the first {first}; they are no samples")
    }
}

/// Complete rows of a table that also has incomplete ones.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CompleteRows {
    /// Their numbers, from 0.
    pub(crate) rows: Vec<usize>,
    /// Number of all rows.
    pub(crate) total: usize,
    /// The first incomplete row, and the column of its missing value.
    pub(crate) first_incomplete: (usize, usize),
}

impl CompleteRows {
    /// Finds the complete rows; `None` if no value is missing. Columns without rows are skipped.
    pub(crate) fn find(columns: &[Vec<f64>]) -> Option<Self> {
        let lacks = |row: usize| {
            columns.iter().position(|column| column.get(row).is_some_and(|value| value.is_nan()))
        };
        let row_count = columns.iter().map(Vec::len).max().unwrap_or_default();
        let first = (0..row_count).find_map(|row| Some((row, lacks(row)?)))?;
        let rows = (0..row_count).filter(|row| lacks(*row).is_none()).collect();
        Some(Self { rows, total: row_count, first_incomplete: first })
    }

    /// Removes the incomplete rows from a column.
    pub(crate) fn retain_complete(&self, column: &mut Vec<f64>) {
        if !column.is_empty() {
            *column = self.rows.iter().map(|row| column[*row]).collect();
        }
    }
}

/// Two columns whose values lie in different rows.
#[derive(Clone, Debug, PartialEq)]
pub struct DisjointColumns {
    /// The columns, each with its number of values.
    pub columns: [(String, usize); 2],
    /// Number of rows in which both have a value.
    pub common_rows: usize,
}

impl DisjointColumns {
    /// Finds the column with the fewest values, and the one that shares the fewest rows with it.
    pub(crate) fn find(columns: &[Vec<f64>], names: &[String]) -> Option<Self> {
        let values = |column: &[f64]| column.iter().filter(|value| !value.is_nan()).count();
        let asked = || columns.iter().zip(names).filter(|(column, _)| !column.is_empty());
        let (fewest, name) = asked().min_by_key(|(column, _)| values(column))?;
        // The time usually comes first, and it is in all rows.
        let together = |other: &[f64]| {
            fewest.iter().zip(other).filter(|(a, b)| !a.is_nan() && !b.is_nan()).count()
        };
        let others = asked().rev().filter(|(_, other)| *other != name);
        let (other, other_name) = others.min_by_key(|(column, _)| together(column))?;
        Some(Self {
            columns: [(name.clone(), values(fewest)), (other_name.clone(), values(other))],
            common_rows: together(other),
        })
    }
}

impl fmt::Display for DisjointColumns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [(one, ones), (other, others)] = &self.columns;
        write!(
            f,
            "column `{one}` has {ones} values and `{other}` {others}, {} of them in the same rows",
            self.common_rows
        )
    }
}
