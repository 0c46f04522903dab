//! Why a table could not be read or written.

use std::path::{Path, PathBuf};

use super::lines::LongLine;
use super::place::RowPlace;
use crate::missing_values::{DisjointColumns, MissingValues};
use crate::uniform::TimesError;

/// Formats the remedy for a row with another number of fields than the header.
fn remedy(found: usize, expected: usize) -> &'static str {
    match found > expected {
        true => "write its decimals with a point, or separate the columns by semicolons",
        false => "complete it, or remove it where a logger was stopped as it wrote it",
    }
}

/// Returns the name of a unit of time, given in seconds.
pub(super) fn unit_of_time(second: f64) -> &'static str {
    match second {
        0.5.. => "seconds (s)",
        0.5e-3.. => "milliseconds (ms)",
        0.5e-6.. => "microseconds (us)",
        _ => "nanoseconds (ns)",
    }
}

/// Formats the reference to the header.
fn header_text(line: &Option<u64>) -> String {
    match line {
        Some(line) => format!("the header in line {line} has"),
        None => "most rows have".to_owned(),
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
    /// A file of no text and no known format: take a table, or read a recording with its bus.
    #[error("{}: a binary file, not a table; name a table (CSV, Parquet), or give a recording of a \
        bus the layout of its bus", file.display())]
    Binary {
        /// The file.
        file: PathBuf,
    },
    /// A text that is not UTF-8: write the file as UTF-8.
    #[error("{}: line {line} is no UTF-8 text; write the file as UTF-8 (a spreadsheet has \"CSV \
        UTF-8\")", file.display())]
    NotUtf8 {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: u64,
    },
    /// A line without an end: the file is not a table.
    #[error("{}: line {line} is longer than 1 MiB; a table has one row per line, check the file",
        file.display())]
    LongLine {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: u64,
    },
    /// A row with another number of fields than the header: mend the line.
    #[error("{}: line {line} has {found} fields, and {} {expected}; {}", file.display(),
        header_text(header_line), remedy(*found, *expected))]
    FieldCount {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: u64,
        /// Number of its fields.
        found: usize,
        /// Number of fields of the header.
        expected: usize,
        /// Line of the header, if there is one.
        header_line: Option<u64>,
    },
    /// The first row has numbers where names of columns belong: put a header before it.
    #[error("{}: the first row has the number `{found}` instead of column names. Put a header \
        before it: time_s, motor_position_rad_1, motor_torque_nm_1, motor_reference_rad_1 and so \
        on, or the same with joint_; or give the numbers of the columns in [data]",
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
    /// Several columns have the requested name: give their numbers.
    #[error("{}: the columns {numbers} are all named `{column}`; give the numbers in place of the \
        name in [data], as columns = [{numbers}]", file.display())]
    DuplicateColumn {
        /// The file.
        file: PathBuf,
        /// The name.
        column: String,
        /// Numbers of the columns, from 1.
        numbers: String,
    },
    /// A requested column is missing.
    #[error("{}: column `{column}` is missing; the header has {available}", file.display())]
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
    /// The times count another unit than configured: the rates differ by a power of a thousand.
    #[error("{}: by the unit in data.time the rows have {found_hz:.6} Hz, and {given_hz} Hz are \
        stated: the times count {}; correct the unit", file.display(), unit_of_time(*second))]
    TimeScale {
        /// The file.
        file: PathBuf,
        /// The rate of the time column with the configured unit \[Hz\].
        found_hz: f64,
        /// The rate that was given \[Hz\].
        given_hz: f64,
        /// Seconds of the unit that fits.
        second: f64,
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

impl TableError {
    /// Creates the error of reading or writing a file.
    pub(super) fn from_io(path: &Path, source: std::io::Error) -> Self {
        let file = path.to_path_buf();
        match source.get_ref().and_then(|error| error.downcast_ref::<LongLine>()) {
            Some(LongLine { line }) => Self::LongLine { file, line: *line },
            None => Self::Io { file, source },
        }
    }

    /// Returns the error with the line in which a record begins, for a record that is too long.
    pub(super) fn of_record(self, first_line: u64) -> Self {
        match self {
            Self::LongLine { file, line } => Self::LongLine { file, line: line.min(first_line) },
            error => error,
        }
    }

    /// Creates the error of parsing or writing a text.
    pub(super) fn from_csv(path: &Path, error: csv::Error) -> Self {
        let file = path.to_path_buf();
        match error.into_kind() {
            csv::ErrorKind::Io(source) => Self::from_io(path, source),
            csv::ErrorKind::Utf8 { pos, .. } => {
                Self::NotUtf8 { file, line: pos.map_or(1, |position| position.line().max(1)) }
            }
            kind => Self::Io { file, source: std::io::Error::other(format!("{kind:?}")) },
        }
    }
}
