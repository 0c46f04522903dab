//! Rows and messages that lack a value: an empty field, null or NaN where a number is asked for. They are no samples.

use core::fmt;

/// What was left out because it lacks a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Holes {
    /// How many.
    pub lacking: usize,
    /// Of how many.
    pub of: usize,
    /// `rows` or `messages`.
    pub what: &'static str,
    /// The first of them, in words.
    pub first: String,
}

impl fmt::Display for Holes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { lacking, of, what, first } = self;
        write!(f, "{lacking} of {of} {what} lack a value, the first {first}; they are no samples")
    }
}

/// The rows that lack no value, where others do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Whole {
    /// Their numbers, from 0.
    pub(crate) rows: Vec<usize>,
    /// How many there are in all.
    pub(crate) of: usize,
    /// The first other one, and the column in which it lacks a value.
    pub(crate) first: (usize, usize),
}

impl Whole {
    /// Nothing where no value lacks. Columns without rows are passed over.
    pub(crate) fn of(columns: &[Vec<f64>]) -> Option<Self> {
        let lacks = |row: usize| {
            columns.iter().position(|column| column.get(row).is_some_and(|value| value.is_nan()))
        };
        let of = columns.iter().map(Vec::len).max().unwrap_or_default();
        let first = (0..of).find_map(|row| Some((row, lacks(row)?)))?;
        let rows = (0..of).filter(|row| lacks(*row).is_none()).collect();
        Some(Self { rows, of, first })
    }

    /// A column without the others.
    pub(crate) fn keep(&self, column: &mut Vec<f64>) {
        if !column.is_empty() {
            *column = self.rows.iter().map(|row| column[*row]).collect();
        }
    }
}

/// Two columns whose values lie in other rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Apart {
    /// Them, each with how many values it has.
    pub columns: [(String, usize); 2],
    /// In how many rows both have one.
    pub together: usize,
}

impl Apart {
    /// That with the fewest values, and the one that has the fewest together with it.
    pub(crate) fn of(columns: &[Vec<f64>], names: &[String]) -> Option<Self> {
        let values = |column: &[f64]| column.iter().filter(|value| !value.is_nan()).count();
        let asked = || columns.iter().zip(names).filter(|(column, _)| !column.is_empty());
        let (fewest, name) = asked().min_by_key(|(column, _)| values(column))?;
        // The time, which is in all rows, stands first as a rule.
        let together = |other: &[f64]| {
            fewest.iter().zip(other).filter(|(a, b)| !a.is_nan() && !b.is_nan()).count()
        };
        let others = asked().rev().filter(|(_, other)| *other != name);
        let (other, other_name) = others.min_by_key(|(column, _)| together(column))?;
        Some(Self {
            columns: [(name.clone(), values(fewest)), (other_name.clone(), values(other))],
            together: together(other),
        })
    }
}

impl fmt::Display for Apart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [(one, ones), (other, others)] = &self.columns;
        write!(
            f,
            "column `{one}` has {ones} values and `{other}` {others}, {} of them in the same rows",
            self.together
        )
    }
}
