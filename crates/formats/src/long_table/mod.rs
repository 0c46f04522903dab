//! Long tables, for databases: a row for each value and its keys, each column of one type, written
//! as CSV or Parquet, and read back.

mod column;
mod error;
mod format;
#[cfg(feature = "parquet")]
mod parquet;
mod text;
mod wanted;

pub use column::{LongColumn, LongValues};
pub use error::LongTableError;
pub use format::{LongFormat, LongTable, read_long_table};

#[cfg(test)]
mod tests;
