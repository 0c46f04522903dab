//! Format of a long table, by its file extension.

use std::io::Write;
use std::path::Path;

use super::column::LongColumn;
use super::error::LongTableError;
use super::text;
use super::wanted::RequestedColumns;

/// Format of a long table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LongFormat {
    /// Text with commas (RFC 4180). A missing value is an empty field; an instant has the form of
    /// RFC 3339.
    Csv,
    /// Parquet, compressed with zstd; every column may have nulls.
    Parquet,
}

impl LongFormat {
    /// Returns the format by the ending of a file's name.
    ///
    /// # Errors
    /// [`LongTableError::Ending`], [`LongTableError::NoParquet`].
    pub fn from_path(path: &Path) -> Result<Self, LongTableError> {
        let is = |end| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
        match (is("csv"), is("parquet")) {
            (true, _) => Ok(Self::Csv),
            (_, true) if cfg!(feature = "parquet") => Ok(Self::Parquet),
            (_, true) => Err(LongTableError::NoParquet),
            _ => Err(LongTableError::Ending),
        }
    }

    /// Begins a table, whose rows are written in parts.
    ///
    /// # Errors
    /// [`LongTableError::NoParquet`].
    pub fn table(self, output: &mut (dyn Write + Send)) -> Result<LongTable<'_>, LongTableError> {
        Ok(LongTable(match self {
            Self::Csv => Inner::Csv(text::TextTable::new(output)),
            #[cfg(feature = "parquet")]
            Self::Parquet => Inner::Parquet(super::parquet::ParquetTable::new(output)),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => return Err(LongTableError::NoParquet),
        }))
    }
}

/// A table that is being written.
#[derive(Debug)]
pub struct LongTable<'o>(Inner<'o>);

enum Inner<'o> {
    Csv(text::TextTable<'o>),
    #[cfg(feature = "parquet")]
    Parquet(super::parquet::ParquetTable<'o>),
}

impl core::fmt::Debug for Inner<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Csv(_) => "Csv",
            #[cfg(feature = "parquet")]
            Self::Parquet(_) => "Parquet",
        })
    }
}

impl LongTable<'_> {
    /// Writes further rows: columns with the same number of values. The columns of all parts have
    /// the same names and types. The first part is written also without rows.
    ///
    /// # Errors
    /// [`LongTableError`].
    pub fn write(&mut self, columns: &[LongColumn<'_>]) -> Result<(), LongTableError> {
        match &mut self.0 {
            Inner::Csv(table) => Ok(table.write(columns)?),
            #[cfg(feature = "parquet")]
            Inner::Parquet(table) => Ok(table.write(columns)?),
        }
    }

    /// Ends the table.
    ///
    /// # Errors
    /// [`LongTableError`].
    pub fn finish(self) -> Result<(), LongTableError> {
        match self.0 {
            Inner::Csv(table) => Ok(table.finish()?),
            #[cfg(feature = "parquet")]
            Inner::Parquet(table) => Ok(table.finish()?),
        }
    }
}

/// Reads the columns with these names from a file, and calls a function with each row. Keeps no row
/// in memory. A missing value is an empty text, and an instant has the form of RFC 3339. The file
/// extension decides the format.
///
/// # Errors
/// [`LongTableError`].
pub fn read_long_table<const N: usize>(
    path: &Path,
    names: [&str; N],
    mut take: impl FnMut([String; N]),
) -> Result<(), LongTableError> {
    let mut wanted = RequestedColumns::new(names, &mut take);
    match LongFormat::from_path(path)? {
        LongFormat::Csv => text::read(path, &mut wanted),
        #[cfg(feature = "parquet")]
        LongFormat::Parquet => super::parquet::read(path, &mut wanted),
        #[cfg(not(feature = "parquet"))]
        LongFormat::Parquet => Err(LongTableError::NoParquet),
    }
}
