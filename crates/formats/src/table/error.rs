//! Why a table could not be read or written.

use std::path::PathBuf;

use super::place::RowPlace;
use crate::missing_values::{DisjointColumns, MissingValues};
use crate::uniform::TimesError;

/// Formats the problem in the text of a table, and the remedy.
fn of_text(error: &csv::Error) -> String {
    let line = |at: &Option<csv::Position>| at.as_ref().map_or(0, csv::Position::line);
    match error.kind() {
        csv::ErrorKind::Utf8 { pos, .. } => format!(
            "line {} is no UTF-8 text; write the file as UTF-8 (a spreadsheet has \"CSV UTF-8\")",
            line(pos).max(1)
        ),
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let problem = match len > expected_len {
                true => "write its decimals with a point, or separate the columns by semicolons",
                false => "complete it, or remove it where a logger was stopped as it wrote it",
            };
            let line = line(pos);
            format!("line {line} has {len} fields, and those before have {expected_len}; {problem}")
        }
        _ => error.to_string(),
    }
}

/// Reason why a table could not be read or written. Every variant names the file, and the line or
/// row if there is one.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened, read or written: check path and permissions.
    #[error("{}: {source}; check the path and the permissions", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A Parquet file, and a build without the feature `parquet`: take the package, or build with
    /// it.
    #[error("{}: a Parquet file, which this build of didim cannot read; the Debian package can, \
        and so can a build with `cargo build --release --features parquet`", file.display())]
    NoParquet {
        /// The file.
        file: PathBuf,
    },
    /// A Parquet file that is damaged, cut off or of a kind that is not read: write it again.
    #[error("{}: the Parquet file cannot be read, it is damaged, encrypted or compressed in an \
        unknown way ({what}); write it again, with snappy, gzip, zstd or lz4", file.display())]
    Parquet {
        /// The file.
        file: PathBuf,
        /// Error of the reader.
        what: String,
    },
    /// A column whose type has no numbers: convert it.
    #[error("{}: column `{column}` holds {what}, and numbers are wanted; write it as DOUBLE, a \
        time as TIMESTAMP", file.display())]
    NoNumbers {
        /// The file.
        file: PathBuf,
        /// The column.
        column: String,
        /// Description of the type.
        what: &'static str,
    },
    /// The type of a time column has another unit than configured: correct `data.time.unit`.
    #[error("{}: column `{column}` counts {found} by its type, and {configured} are stated; \
        correct the unit in data.time", file.display())]
    TimeUnit {
        /// The file.
        file: PathBuf,
        /// The column.
        column: String,
        /// The unit of its type.
        found: &'static str,
        /// The unit that the cell, or the name `time_s`, states.
        configured: &'static str,
    },
    /// Not a CSV table, or a row with another number of fields than the header: mend the line, or
    /// write the file as UTF-8.
    #[error("{}: {}", file.display(), of_text(error))]
    Table {
        /// The file.
        file: PathBuf,
        /// Error of the parser, with the line.
        error: csv::Error,
    },
    /// The first row has numbers where names of columns belong: put a header before it.
    #[error("{}: the first row has the number `{found}` instead of column names. Put a header \
        before it: time_s, motor_position_rad_1, motor_torque_nm_1, motor_reference_rad_1 and so \
        on, or the same with joint_",
        file.display()
    )]
    NoHeader {
        /// The file.
        file: PathBuf,
        /// Its first bytes.
        found: String,
    },
    /// A header name that the format does not know: rename or remove the column.
    #[error("{}: column `{column}` is not known; expected time_s and motor_position_rad_1, \
        motor_torque_nm_1, motor_reference_rad_1 and so on, or the same with joint_",
        file.display()
    )]
    UnknownColumn {
        /// The file.
        file: PathBuf,
        /// The header name.
        column: String,
    },
    /// One column is requested for two signals.
    #[error("{}: column `{column}` is asked for twice; name each column once", file.display())]
    AskedTwice {
        /// The file.
        file: PathBuf,
        /// The column.
        column: String,
    },
    /// Requested columns are missing or appear twice.
    #[error(
        "{}: column `{column}` is missing or appears twice; the header has {available}",
        file.display()
    )]
    NoSuchColumn {
        /// The file.
        file: PathBuf,
        /// The column that is expected exactly once.
        column: String,
        /// The available columns.
        available: String,
    },
    /// Columns of one quantity are missing, repeated or numbered with gaps.
    #[error("{}: column `{column}` is missing or appears twice; every axis from 1 to {axes} needs \
        one", file.display())]
    Columns {
        /// The file.
        file: PathBuf,
        /// The column that is expected exactly once.
        column: String,
        /// The number of axes that the header implies.
        axes: usize,
    },
    /// Motor-side and joint-side columns in one file: keep one side.
    #[error("{}: the header mixes motor_ and joint_ columns; keep one side", file.display())]
    MixedSides {
        /// The file.
        file: PathBuf,
    },
    /// A requested column has no values.
    #[error("{}: column `{column}` has no value in any row; was it recorded? Name another column \
        in [data], or record it", file.display())]
    NoValues {
        /// The file.
        file: PathBuf,
        /// The column.
        column: String,
    },
    /// Rows miss values, and a complete experiment is required.
    #[error("{}: {missing_values}; a complete experiment is needed", file.display())]
    MissingValues {
        /// The file.
        file: PathBuf,
        /// Number of these rows.
        missing_values: MissingValues,
    },
    /// So many rows miss values that the others form no record: signals of different rates, each in
    /// separate rows.
    #[error("{}: {missing_values}. The others are no record: {source}. {distant}: signals of other \
        sources or rates, each in its own rows? Put all on common times, the positions' as a rule, \
        before they are exported, or record them in one message", file.display())]
    DisjointColumns {
        /// The file.
        file: PathBuf,
        /// Number of rows with missing values.
        missing_values: MissingValues,
        /// Problem of the other rows.
        source: TimesError,
        /// Two columns with values in different rows.
        distant: Box<DisjointColumns>,
    },
    /// A field that is not a finite number.
    #[error("{}: {place}, column `{column}`: `{text}` is not a finite number", file.display())]
    NotANumber {
        /// The file.
        file: PathBuf,
        /// Where it stands.
        place: RowPlace,
        /// The column's header name.
        column: String,
        /// Text found there.
        text: String,
    },
    /// A field is no date, although dates are configured.
    #[error("{}: {place}, column `{column}`: `{text}` is no date with a time of day (ISO 8601); \
        write 2024-05-01T12:00:00.123456Z or with an offset as +02:00, or state the unit that the \
        column has in data.time", file.display())]
    NotADate {
        /// The file.
        file: PathBuf,
        /// Where it stands.
        place: RowPlace,
        /// The column's header name.
        column: String,
        /// Text found there.
        text: String,
    },
    /// A field is a date, although numbers are configured.
    #[error("{}: {place}, column `{column}`: `{text}` is a date, and a number is stated; state \
        unit = \"iso8601\" in data.time", file.display())]
    Date {
        /// The file.
        file: PathBuf,
        /// Where it stands.
        place: RowPlace,
        /// The column's header name.
        column: String,
        /// Text found there.
        text: String,
    },
    /// A part of a stamp has an impossible value.
    #[error("{}: {place}, column `{column}`: {value} is not {wanted}; put the right column into \
        data.time, or one with its unit as `column`", file.display())]
    NotFractional {
        /// The file.
        file: PathBuf,
        /// Where it stands.
        place: RowPlace,
        /// The column's header name.
        column: String,
        /// Value found there.
        value: f64,
        /// Expected content.
        wanted: &'static str,
    },
    /// Neither a `time_s` column nor a sample rate was given: give one of them.
    #[error(
        "{}: there is no time_s column; give the sampling frequency with --sample-rate HZ",
        file.display()
    )]
    NoTime {
        /// The file.
        file: PathBuf,
    },
    /// The times of the rows form no record.
    #[error("{}: {source}", file.display())]
    Times {
        /// The file.
        file: PathBuf,
        /// Problem of the times.
        source: TimesError,
    },
    /// Time does not advance by one period per row: samples are missing or repeated there.
    #[error("{}: {place}: the time, {time_s:.9} s after the first, leaves the uniform grid of \
        {sample_rate_hz:.6} Hz (expected {expected_s:.9} s); samples are missing or repeated",
        file.display()
    )]
    NotUniform {
        /// The file.
        file: PathBuf,
        /// Where it stands.
        place: RowPlace,
        /// Time of this row after the first \[s\].
        time_s: f64,
        /// Time of the grid at this row after the first \[s\].
        expected_s: f64,
        /// The grid's frequency \[Hz\].
        sample_rate_hz: f64,
    },
    /// The given rate differs from that of the times by more than
    /// [`TimeLimits::same_rate`](crate::TimeLimits::same_rate) and their rounding: omit the rate or
    /// correct it.
    #[error("{}: the times say {found_hz:.6} Hz and {given_hz} Hz are stated; correct \
        --sample-rate or data.rate_hz, or leave the option out", file.display())]
    RateMismatch {
        /// The file.
        file: PathBuf,
        /// The rate of the time column \[Hz\].
        found_hz: f64,
        /// The rate that was given \[Hz\].
        given_hz: f64,
    },
    /// More samples than the free memory holds. Free some, or cut the measurement.
    #[error("{}: more than {samples} samples, for which memory is free; free some, or cut the \
        measurement", file.display())]
    TooLong {
        /// The file.
        file: PathBuf,
        /// Number of samples that fit.
        samples: usize,
    },
    /// Fewer than two rows.
    #[error("{}: fewer than two samples", file.display())]
    TooShort {
        /// The file.
        file: PathBuf,
    },
}
