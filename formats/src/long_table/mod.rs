//! Long tables, for databases: a row for each value and what tells it apart, each column of one type, written as CSV or
//! Parquet.

#[cfg(feature = "parquet")]
mod parquet;
mod text;

use std::io::{self, Write};
use std::path::Path;

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct LongColumn<'a> {
    /// Its name; with the unit, where all its values have one.
    pub name: &'static str,
    /// A value for each row, or none.
    pub values: LongValues<'a>,
}

/// The values of a column, as many as there are rows.
#[derive(Clone, Debug, PartialEq)]
pub enum LongValues<'a> {
    /// Texts.
    Text(Vec<Option<&'a str>>),
    /// Numbers; what is no number is written as none.
    Number(Vec<Option<f64>>),
    /// Whole numbers.
    Count(Vec<Option<u64>>),
    /// Yes or no.
    Flag(Vec<Option<bool>>),
    /// Instants, in seconds after 1970-01-01T00:00:00Z.
    Time(Vec<Option<u64>>),
}

/// What a long table is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LongFormat {
    /// Text with commas (RFC 4180); none is an empty field, an instant that of RFC 3339.
    Csv,
    /// Parquet, compressed with zstd; every column may have nulls.
    Parquet,
}

/// Why a long table was not written. None names the file, which the caller knows.
#[derive(Debug, thiserror::Error)]
pub enum LongTableError {
    /// The ending of the name says no format.
    #[error("the name ends neither in .csv nor in .parquet; choose one of them")]
    Ending,
    /// A Parquet file, and a build without the feature `parquet`: take the package, or build with it.
    #[error(
        "a Parquet file, which this build of didim cannot write; the Debian package can, and so can a build with \
         `cargo build --release --features parquet`; or write a .csv"
    )]
    NoParquet,
    /// It cannot be written: check the space.
    #[error("{0}; check the space on the disk")]
    Io(#[from] io::Error),
}

impl LongFormat {
    /// By the ending of a file's name.
    ///
    /// # Errors
    /// [`LongTableError::Ending`], [`LongTableError::NoParquet`].
    pub fn of(path: &Path) -> Result<Self, LongTableError> {
        let is = |end| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
        match (is("csv"), is("parquet")) {
            (true, _) => Ok(Self::Csv),
            (_, true) if cfg!(feature = "parquet") => Ok(Self::Parquet),
            (_, true) => Err(LongTableError::NoParquet),
            _ => Err(LongTableError::Ending),
        }
    }

    /// Writes a table, whose columns have one number of rows.
    ///
    /// # Errors
    /// [`LongTableError`].
    pub fn write(
        self,
        columns: &[LongColumn<'_>],
        output: &mut dyn Write,
    ) -> Result<(), LongTableError> {
        match self {
            Self::Csv => Ok(text::write(columns, output)?),
            #[cfg(feature = "parquet")]
            Self::Parquet => Ok(parquet::write(columns, output)?),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(LongTableError::NoParquet),
        }
    }
}

impl LongValues<'_> {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Count(values) | Self::Time(values) => values.len(),
            Self::Flag(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests;
