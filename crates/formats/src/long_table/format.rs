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

    /// Writes a table whose columns have the same number of rows.
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
            Self::Parquet => Ok(super::parquet::write(columns, output)?),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(LongTableError::NoParquet),
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
