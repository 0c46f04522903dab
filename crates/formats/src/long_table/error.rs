//! Why a long table could not be written or read.

use std::io;

/// Reason why a long table was not written or read. The caller knows the file.
#[derive(Debug, thiserror::Error)]
pub enum LongTableError {
    /// The file extension belongs to no format.
    #[error("the name ends neither in .csv nor in .parquet; choose one of them")]
    Ending,
    /// A Parquet file, and a build without the feature `parquet`: take the package, or build with
    /// it.
    #[error(
        "a Parquet file, which this build of didim cannot write; the Debian package can, and so \
         can a build with `cargo build --release --features parquet`; or write a .csv"
    )]
    NoParquet,
    /// It cannot be read or written: check path, permissions and space.
    #[error("{0}; check path, permissions and the space on the disk")]
    Io(#[from] io::Error),
    /// The content does not match the ending of its name, or is damaged: write it again.
    #[error("not a table of its kind, or damaged ({0}); write it again")]
    Damaged(String),
    /// A requested column is missing: write the file again with this version.
    #[error("it has no column `{column}`; write it again with this version of didim")]
    NoColumn {
        /// The column.
        column: String,
    },
}
