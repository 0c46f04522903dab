//! Columns of a long table.

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct LongColumn<'a> {
    /// Its name, with the unit if all values have the same.
    pub name: &'static str,
    /// A value for each row, or none.
    pub values: LongValues<'a>,
}

/// Values of a column, one for each row.
#[derive(Clone, Debug, PartialEq)]
pub enum LongValues<'a> {
    /// Texts.
    Text(Vec<Option<&'a str>>),
    /// Numbers; an invalid number is written as a missing value.
    Number(Vec<Option<f64>>),
    /// Whole numbers.
    Count(Vec<Option<u64>>),
    /// Yes or no.
    Flag(Vec<Option<bool>>),
    /// Instants, in seconds after 1970-01-01T00:00:00Z.
    Time(Vec<Option<u64>>),
}

impl LongValues<'_> {
    /// Returns their number.
    pub fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Count(values) | Self::Time(values) => values.len(),
            Self::Flag(values) => values.len(),
        }
    }

    /// Returns true without values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
