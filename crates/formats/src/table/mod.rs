//! Tables of measured signals with one row per sample. Text and Parquet are read in the same way.
//!
//! didim's own have SI units in the names: `time_s` (optional when the sample rate is given), then
//! `motor_position_rad_1..n`, `motor_torque_nm_1..n` and optionally `motor_reference_rad_1..n`; or
//! the same with `joint_`. Tables of other programs are read by the names and units of their
//! [`Columns`]. A file is text, which gzip may have compressed, or Parquet.

mod arrays;
mod column;
mod error;
mod grid;
mod header;
mod lines;
mod list;
#[cfg(feature = "parquet")]
mod parquet;
mod place;
mod rows;
mod source;
mod text;
mod text_layout;
mod time;
mod uniform_record;
mod utf16;
mod write;

use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use crate::capacity::Capacity;
use crate::columns::{Columns, Quantity, TableColumns, unwrap_turns};
use crate::container::begins_with;
use crate::measurement::{Measurement, Side};
use crate::missing_values::{CompleteRows, DisjointColumns, MissingValues};
use crate::record::Record;
use crate::uniform::TimesError;
use column::Column;
use header::Header;
use rows::IncompleteRows;
use source::{Source, TableValues};
use text::TextTable;
use time::ExactTime;
use uniform_record::{row_times, to_record};
use utf16::{Utf16Reader, utf16_encoding};

use error::unit_of_time;

pub use arrays::SignalArrays;
pub use error::TableError;
pub use header::list_names;
pub use place::RowPlace;
pub use rows::Table;
pub use write::write_csv;

/// Reads a complete experiment with didim's own columns and uniform times.
///
/// `sample_rate_hz` replaces a missing time column; when both are there they must agree.
///
/// # Errors
/// See [`TableError`].
pub fn read_csv(path: &Path, sample_rate_hz: Option<f64>) -> Result<Measurement, TableError> {
    let table = read(open(path, None)?, path, sample_rate_hz.is_none(), None)?;
    if let Some(IncompleteRows { missing_values, .. }) = table.incomplete_rows {
        return Err(TableError::MissingValues { file: path.to_path_buf(), missing_values });
    }
    let rate_hz = table.grid(sample_rate_hz, path)?.rate_hz;
    Ok(table.into_measurement(rate_hz))
}

/// Reads a table with didim's own columns or with configured ones. A table with all of its own
/// columns and none of the configured ones is read by its own, with corrections. Rows with
/// jittering times are resampled to `nominal_hz`. The record is cut at missing samples and values.
///
/// `sample_rate_hz` replaces a missing time column; when both are there they must agree.
///
/// # Errors
/// See [`TableError`].
pub fn read_table<'a>(
    path: &Path,
    sample_rate_hz: Option<f64>,
    nominal_hz: f64,
    columns: impl Into<TableColumns<'a>>,
) -> Result<Record, TableError> {
    let TableColumns { configured, own } = columns.into();
    let source = open(path, configured)?;
    let header = own_header(source.as_ref(), path, configured);
    let corrected = header.as_ref().zip(own).map(|(header, own)| header.corrected(own));
    let columns = if header.is_some() { corrected.as_ref() } else { configured };
    let mut table = read(source, path, sample_rate_hz.is_none(), columns)?;
    let missing = table.incomplete_rows.take();
    if let (None, Some(missing_rows), Some(rate_hz)) = (&table.time, &missing, sample_rate_hz) {
        // Without times, the time of a row follows from its number.
        let rows = missing_rows.complete_rows.rows.iter().copied();
        table.time = Some(row_times(rows, rate_hz));
    }
    let start = table.start();
    let mut record =
        to_record(table, path, sample_rate_hz, nominal_hz).map(|of| of.with_start(start));
    match (&mut record, missing) {
        (_, None) => {}
        (Ok(record), Some(IncompleteRows { missing_values, .. })) => {
            record.missing_values = Some(missing_values)
        }
        (Err(error), Some(IncompleteRows { missing_values, disjoint_columns: distant, .. })) => {
            let source = match *error {
                TableError::Times { source, .. } => source,
                TableError::RateMismatch { found_hz, given_hz: stated_hz, .. } => {
                    TimesError::Rate { found_hz, stated_hz }
                }
                _ => return record,
            };
            return Err(TableError::DisjointColumns {
                file: path.to_path_buf(),
                missing_values,
                source,
                distant,
            });
        }
    }
    record
}

/// Returns the header of a table that is read by didim's own columns.
fn own_header(source: &dyn Source, path: &Path, columns: Option<&Columns>) -> Option<Header> {
    let wanted = columns.map(Columns::all_names).unwrap_or_default();
    let is_configured = source.names().iter().any(|name| wanted.contains(name));
    if is_configured { None } else { Header::parse(source, path).ok() }
}

/// Returns the side of a table that [`read_table`] reads by didim's own columns. `None` for others,
/// for a file without a header in its first line, and for one that cannot be read.
pub fn own_side(path: &Path, columns: Option<&Columns>) -> Option<Side> {
    let mut begin = Vec::new();
    File::open(path).ok()?.take(FIRST_LINE).read_to_end(&mut begin).ok()?;
    let text = str::from_utf8(begin.split(|byte| *byte == b'\n').next()?).ok()?;
    let configured = columns.map(Columns::all_names).unwrap_or_default();
    let mut own_side = None;
    for name in text.trim().split(',').map(|name| name.trim().trim_matches('"')) {
        if configured.iter().any(|of| of == name) {
            return None;
        }
        own_side = own_side.or(header::own_side_of_name(name)?);
    }
    own_side
}

/// Number of bytes in which a header of didim's own columns ends.
const FIRST_LINE: u64 = 4096;

/// First bytes of a gzip file (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// The first bytes of a Parquet file.
const PARQUET_MAGIC: [u8; 4] = *b"PAR1";

/// Returns true for a Parquet file, by its first bytes.
pub fn is_parquet(path: &Path) -> bool {
    begins_with(path, &PARQUET_MAGIC)
}

/// Returns true for a file that is compressed by gzip, by its first bytes.
pub fn is_gzip(path: &Path) -> bool {
    begins_with(path, &GZIP_MAGIC)
}

/// Returns the first line that is not blank, or its beginning.
fn first_line(begin: &[u8]) -> &[u8] {
    let mut lines = begin.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    lines.find(|line| !line.is_empty()).unwrap_or_default()
}

/// Opens a table of either kind. Its first bytes identify the kind.
fn open(path: &Path, columns: Option<&Columns>) -> Result<Box<dyn Source>, TableError> {
    let wrong = |source| TableError::Io { file: path.to_path_buf(), source };
    let mut file = BufReader::new(File::open(path).map_err(wrong)?);
    let begin = file.fill_buf().map_err(wrong)?;
    if begin.starts_with(&PARQUET_MAGIC) {
        #[cfg(feature = "parquet")]
        return Ok(Box::new(parquet::ParquetTable::open(file.into_inner(), path)?));
        #[cfg(not(feature = "parquet"))]
        return Err(TableError::NoParquet { file: path.to_path_buf() });
    }
    let input: Box<dyn BufRead> = if begin.starts_with(&GZIP_MAGIC) {
        Box::new(BufReader::new(MultiGzDecoder::new(file)))
    } else if let Some(encoding) = utf16_encoding(begin) {
        Box::new(Utf16Reader::new(file, encoding))
    } else if first_line(begin).contains(&0) {
        return Err(TableError::Binary { file: path.to_path_buf() });
    } else {
        Box::new(file)
    };
    let wanted = columns.map(Columns::all_names).unwrap_or_default();
    Ok(Box::new(TextTable::open(input, path, &wanted)?))
}

/// The header of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TableNames {
    /// Its columns.
    pub columns: Vec<String>,
    /// Seconds per unit of each column with a time type.
    pub seconds_per_unit: Vec<Option<f64>>,
    /// Unit of each column, from a row of units below the header; empty without one.
    pub units: Vec<String>,
    /// Texts of the first row, by column; empty if the file has types.
    pub first_row: Vec<String>,
    /// True for each column that cannot be a signal, because it has texts.
    pub has_text: Vec<bool>,
    /// False if the table has no header. The names are the numbers of the columns, from 1.
    pub has_header: bool,
    /// Side of the transmission, and true if there is a time. `None` if not all columns are didim's
    /// own.
    pub own_format: Option<(Side, bool)>,
}

/// Reads the header of a table.
///
/// # Errors
/// See [`TableError`].
pub fn list_table(path: &Path) -> Result<TableNames, TableError> {
    let mut source = open(path, None)?;
    source.find_texts();
    let columns = source.names().to_vec();
    let seconds = (0..columns.len()).map(|column| source.seconds_per_unit(column)).collect();
    let standard_side =
        Header::parse(source.as_ref(), path).ok().map(|header| (header.side, header.has_time));
    Ok(TableNames {
        columns,
        seconds_per_unit: seconds,
        units: source.units().to_vec(),
        first_row: source.first_row_texts().to_vec(),
        has_text: (0..source.names().len()).map(|column| source.has_text(column)).collect(),
        has_header: source.has_header(),
        own_format: standard_side,
    })
}

/// Reads the rows of a table without checking a rate.
///
/// # Errors
/// See [`TableError`].
pub fn read_rows(path: &Path, columns: Option<&Columns>) -> Result<Table, TableError> {
    read(open(path, columns)?, path, false, columns)
}

/// Reads the requested columns, in SI units.
fn read(
    source: Box<dyn Source>,
    path: &Path,
    needs_time: bool,
    columns: Option<&Columns>,
) -> Result<Table, TableError> {
    let file = || path.to_path_buf();
    let header = match columns {
        None => Header::parse(source.as_ref(), path)?,
        Some(columns) => Header::of_columns(source.as_ref(), columns, path)?,
    };
    if needs_time && !header.has_time {
        return Err(TableError::NoTime { file: file() });
    }
    let second = columns.map_or(1.0, Columns::seconds_per_unit);
    check_time_unit(source.as_ref(), path, &header, second)?;
    let (first_row, names) = (source.first_row(), source.names().to_vec());
    let is_read = |column: &&Column| !matches!(column, Column::Other);
    let capacity = Capacity::of_values(header.columns.iter().filter(is_read).count());
    let TableValues { columns: mut numbers, mut resolution, first_time: mut first, mut begins } =
        source.read(&header.columns, capacity)?;
    let incomplete_rows = leave_out(&mut numbers, &names, first_row, path)?;
    if let Some(incomplete) = &incomplete_rows {
        let rows = &incomplete.complete_rows.rows;
        begins.iter_mut().for_each(|begin| *begin = rows.partition_point(|row| row < begin));
    }
    let (mut time, mut rows) = (None, 0);
    let mut parts: [Option<(usize, Vec<f64>)>; 2] = [None, None];
    let mut signals: [Vec<Vec<f64>>; 3] = std::array::from_fn(|_| vec![Vec::new(); header.axes]);
    if !header.has_reference {
        signals[Quantity::Reference as usize].clear();
    }
    for (index, (column, mut numbers)) in header.columns.iter().zip(numbers).enumerate() {
        rows = rows.max(numbers.len());
        match *column {
            Column::Seconds => parts[0] = Some((index, numbers)),
            Column::Nanoseconds => parts[1] = Some((index, numbers)),
            Column::Time | Column::Date => {
                numbers.iter_mut().for_each(|time| *time *= second);
                time = Some(numbers);
            }
            Column::Signal(quantity, axis) => {
                let scale = columns.map_or(1.0, |columns| columns.scale(quantity, axis));
                let zero = columns.map_or(0.0, |columns| columns.zero(quantity, axis));
                numbers.iter_mut().for_each(|value| *value = (*value - zero) * scale);
                if columns.is_some_and(|columns| columns.is_wrapped(quantity, axis)) {
                    unwrap_turns(&mut numbers);
                }
                signals[quantity as usize][axis] = numbers;
            }
            Column::Other => {}
        }
    }
    if let [Some(seconds), Some(nanoseconds)] = parts {
        let rows = incomplete_rows.as_ref().map(|rows| rows.complete_rows.rows.as_slice());
        let stamps = stamp_times([seconds, nanoseconds], &names, path, |row| {
            first_row.rows_later(rows.map_or(row, |rows| rows[row]))
        });
        (time, first) = stamps.map(|(times_s, first)| (Some(times_s), first))?;
        resolution = 1e-9;
    }
    if rows < 2 {
        return Err(TableError::TooShort { file: file() });
    }
    let resolution_s = second * resolution;
    let Header { side, axes, .. } = header;
    let first_ns = first.map(|first| first.to_nanoseconds(second));
    Ok(Table {
        side,
        axes,
        first_row,
        time,
        resolution_s,
        second,
        first_ns,
        signals,
        begins,
        incomplete_rows,
    })
}

/// Returns the times of stamps in two columns, each with its index. `place` returns the place of a
/// row.
fn stamp_times(
    [(sec, seconds), (nanosec, nanoseconds)]: [(usize, Vec<f64>); 2],
    names: &[String],
    path: &Path,
    place: impl Fn(usize) -> RowPlace,
) -> Result<(Vec<f64>, Option<ExactTime>), TableError> {
    time::of_parts(&seconds, &nanoseconds).map_err(|(is_sec, (row, value, wanted))| {
        let column = names[if is_sec { sec } else { nanosec }].clone();
        let (file, place) = (path.to_path_buf(), place(row));
        TableError::NotFractional { file, place, column, value, wanted }
    })
}

/// Refuses a time column whose type has another unit than the configured one.
fn check_time_unit(
    source: &dyn Source,
    path: &Path,
    header: &Header,
    second: f64,
) -> Result<(), TableError> {
    if let Some(index) = header.columns.iter().position(Column::is_time)
        && let Some(own) = source.seconds_per_unit(index)
        && let is_date = header.columns[index] == Column::Date
        && (is_date || (own / second - 1.0).abs() > f64::EPSILON)
    {
        let column = source.names()[index].clone();
        let configured_unit =
            if is_date { "dates in text (iso8601)" } else { unit_of_time(second) };
        let column_unit = unit_of_time(own);
        return Err(TableError::TimeUnit {
            file: path.to_path_buf(),
            column,
            found: column_unit,
            configured: configured_unit,
        });
    }
    Ok(())
}

/// Leaves out the rows that lack a value.
fn leave_out(
    columns: &mut [Vec<f64>],
    names: &[String],
    first_row: RowPlace,
    path: &Path,
) -> Result<Option<IncompleteRows>, TableError> {
    let file = path.to_path_buf();
    let is_empty = |column: &Vec<f64>| !column.is_empty() && column.iter().all(|v| v.is_nan());
    if let Some(index) = columns.iter().position(is_empty) {
        return Err(TableError::NoValues { file, column: names[index].clone() });
    }
    let (Some(complete), Some(spread)) =
        (CompleteRows::find(columns), DisjointColumns::find(columns, names))
    else {
        return Ok(None);
    };
    let (row, column) = complete.first_incomplete;
    let missing_values = MissingValues {
        missing: complete.total - complete.rows.len(),
        total: complete.total,
        row_kind: "rows",
        first_missing: format!("in {}, column `{}`", first_row.rows_later(row), names[column]),
    };
    let without_row = Box::new(spread);
    if complete.rows.len() < 2 {
        let source = TimesError::TooShort;
        return Err(TableError::DisjointColumns {
            file,
            missing_values,
            source,
            distant: without_row,
        });
    }
    columns.iter_mut().for_each(|column| complete.retain_complete(column));
    Ok(Some(IncompleteRows {
        complete_rows: complete,
        missing_values,
        disjoint_columns: without_row,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{AxisColumns, AxisCorrections, OwnColumns, TimeColumns};
    use crate::start::RecordingStart;
    use crate::uniform::Resampled;
    use didim_dynamics::Signals;

    fn read_complete(
        text: &[u8],
        declared: Option<f64>,
        columns: Option<&Columns>,
    ) -> Result<Measurement, TableError> {
        let path = Path::new("x.csv");
        let input = Box::new(std::io::Cursor::new(text.to_vec()));
        let wanted = columns.map(Columns::all_names).unwrap_or_default();
        let source = Box::new(TextTable::open(input, path, &wanted)?);
        let table = read(source, path, declared.is_none(), columns)?;
        let rate_hz = table.grid(declared, path)?.rate_hz;
        Ok(table.into_measurement(rate_hz))
    }

    fn of_text(text: &str, rate: Option<f64>) -> Result<Measurement, TableError> {
        read_complete(text.as_bytes(), rate, None)
    }

    fn message(text: &str, rate: Option<f64>) -> String {
        of_text(text, rate).expect_err("must be refused").to_string()
    }

    const HEADER: &str = "time_s,joint_position_rad_1,joint_torque_nm_1\n";

    #[test]
    fn what_was_written_is_read_back_bit_for_bit() {
        let measurement = Measurement {
            side: Side::Motor,
            rate_unchecked: false,
            signals: Signals {
                sample_rate_hz: 5000.0,
                position_rad: vec![vec![0.1, 1.0 / 3.0, 7e-9], vec![-1.0, 2.0, 3.0]],
                torque_nm: vec![vec![1.5, -0.25, 1e300], vec![0.0, 1.0, 2.0]],
                reference_rad: Some(vec![vec![0.1, 0.2, 0.3], vec![1.0, 2.0, 3.0]]),
            },
        };
        let mut bytes = Vec::new();
        write_csv(&measurement, &mut bytes, Path::new("x.csv")).unwrap();
        let read = read_complete(&bytes, Some(5000.0), None).unwrap();
        assert_eq!(read, measurement);
    }

    #[test]
    fn a_table_for_which_there_is_no_room_is_refused_with_how_much_there_is() {
        let text = HEADER.to_owned() + "0,1,2\n0.1,2,3\n0.2,3,4\n";
        let read = |samples| {
            let input = Box::new(std::io::Cursor::new(text.clone().into_bytes()));
            let source = Box::new(TextTable::open(input, Path::new("x.csv"), &[]).unwrap());
            source.read(&[Column::Time; 3], Capacity { samples })
        };
        assert_eq!(read(3).unwrap().columns[0].len(), 3);
        let refused = read(2).err().unwrap().to_string();
        assert!(refused.starts_with("x.csv: more than 2 samples, for which memory"), "{refused}");
    }

    #[test]
    fn columns_may_stand_in_any_order() {
        let read =
            of_text("joint_torque_nm_1,joint_position_rad_1\n1,2\n3,4\n", Some(10.0)).unwrap();
        assert_eq!(read.signals.torque_nm, [[1.0, 3.0]]);
        assert_eq!(read.signals.position_rad, [[2.0, 4.0]]);
        assert_eq!((read.side, read.signals.reference_rad), (Side::Joint, None));
    }

    #[test]
    fn a_dropped_row_is_named_by_its_line() {
        let rows: String = [0, 1, 2, 4, 5, 6].iter().map(|k| format!("0.{k},0,0\n")).collect();
        let text = message(&format!("{HEADER}{rows}"), None);
        assert!(text.contains("line 5") && text.contains("10.0"), "{text}");
    }

    #[test]
    fn rounded_times_are_a_uniform_grid() {
        let rows: String =
            (0..1000).map(|k| format!("{:.4},0,0\n", f64::from(k) / 3000.0)).collect();
        let read = of_text(&format!("{HEADER}{rows}"), None).unwrap();
        assert!(
            (read.signals.sample_rate_hz - 3000.0).abs() < 0.5,
            "{}",
            read.signals.sample_rate_hz
        );
    }

    #[test]
    fn a_rate_that_is_given_is_the_tables_own_within_what_rounding_leaves_open() {
        let table = |rate: f64, decimals: usize| {
            let row = |k| format!("{:.decimals$},0,0\n", f64::from(k) / rate);
            format!("{HEADER}{}", (0..1000).map(row).collect::<String>())
        };
        for (rate, decimals, same) in
            [(3000.0, 9, true), (3000.6, 9, true), (3001.5, 9, false), (3001.5, 4, true)]
        {
            let read = of_text(&table(rate, decimals), Some(3000.0));
            assert_eq!(read.is_ok(), same, "{rate} {decimals}: {read:?}");
        }
    }

    #[test]
    fn bad_tables_say_what_and_where() {
        let cases = [
            (format!("{HEADER}0,1,2\n0.1,inf,2\n"), "line 3, column `joint_position_rad_1`: `inf`"),
            (format!("{HEADER}0,1,\n0.1,1,NaN\n"), "`joint_torque_nm_1` has no value in any row"),
            (format!("{HEADER}0,1,2\n0.1,1\n"), "line 3"),
            ("time_s,joint_position_deg_1\n".into(), "`joint_position_deg_1` is not known"),
            ("0.000,0.1,-2.5\n0.004,0.1,-2.4\n".into(), "Put a header before it"),
            ("joint_position_rad_17,time_s\n".into(), "`joint_position_rad_17` is not known"),
            ("time_s,joint_position_rad_1\n".into(), "`joint_torque_nm_1` is missing"),
            ("motor_position_rad_1,joint_torque_nm_1\n".into(), "mixes motor_ and joint_"),
            (format!("{HEADER}0,1,2\n"), "fewer than two"),
            (format!("{HEADER}0,1,2\n0,1,2\n"), "leaves the uniform grid"),
        ];
        for (text, expected) in cases {
            let said = message(&text, None);
            assert!(said.starts_with("x.csv: ") || said.contains(expected), "{said}");
            assert!(said.contains(expected), "{said} should contain {expected}");
        }
        assert!(
            message("joint_position_rad_1,joint_torque_nm_1\n1,2\n1,2\n", None)
                .contains("--sample-rate")
        );
        assert!(message(&format!("{HEADER}0,1,2\n0.1,1,2\n"), Some(20.0)).contains("10.0"));
    }

    #[cfg(not(feature = "parquet"))]
    #[test]
    fn a_parquet_file_is_recognised_by_its_first_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.csv");
        std::fs::write(&path, b"PAR1 and more").unwrap();
        assert!(is_parquet(&path) && !is_parquet(folder.path()));
        let said = read_table(&path, None, 100.0, None).unwrap_err().to_string();
        assert!(said.contains("cargo build --release --features parquet"), "{said}");
    }

    #[test]
    fn corrections_of_own_columns_are_for_positions_references_and_torques() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("own.csv");
        let names = ["position_rad", "torque_nm", "reference_rad"];
        let names = names.map(|of| format!("joint_{of}_1,joint_{of}_2")).join(",");
        std::fs::write(&path, format!("{names}\n{}", "1,2,3,4,5,6\n".repeat(200))).unwrap();
        let own = OwnColumns {
            position: AxisCorrections { scales: vec![2.0, -1.0], zeros: vec![0.5, 0.0] },
            torque: AxisCorrections { scales: vec![1.0, 3.0], zeros: Vec::new() },
        };
        let first = |columns: TableColumns<'_>| {
            let read = read_table(&path, Some(100.0), 100.0, columns).unwrap();
            let signals = read.into_whole().unwrap().signals;
            let reference_rad = signals.reference_rad.unwrap();
            let all = [signals.position_rad, signals.torque_nm, reference_rad].concat();
            all.iter().map(|values| values[100]).collect::<Vec<f64>>()
        };
        let corrected = first(TableColumns { configured: None, own: Some(&own) });
        assert_eq!(corrected, [1.0, -2.0, 3.0, 12.0, 9.0, -6.0]);
        // Columns of another program that the table does not have change nothing.
        let configured =
            Columns { axes: 2, ..Columns::of_time(TimeColumns::Dates { column: "t".into() }) };
        for configured in [None, Some(&configured)] {
            assert_eq!(first(TableColumns::from(configured)), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            let both = TableColumns { configured, own: Some(&own) };
            assert_eq!(first(both), corrected);
        }
    }

    /// 200 rows of 100 Hz, as (time, position, torque) by the number of the row.
    fn record_of(header: &str, row: impl Fn(usize) -> String) -> Result<Record, TableError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let rows: String = (0..200).map(row).collect();
        std::fs::write(&path, format!("{header}{rows}")).unwrap();
        read_table(&path, Some(100.0), 100.0, None)
    }

    #[test]
    #[expect(clippy::cast_precision_loss, reason = "rows")]
    fn what_lacks_a_value_is_a_loss_and_no_number() {
        let field = |lacks: bool, value: f64| if lacks { String::new() } else { value.to_string() };
        let sine = |row: usize| (0.03 * row as f64).sin();
        let parts = |record: &Record| -> Vec<(f64, usize)> {
            let describe =
                |piece: &crate::record::Piece| (piece.begins_s, piece.measurement.samples());
            record.segments.iter().map(describe).collect()
        };
        // Several rows cut, one alone is interpolated; by the times, or by where rows stand.
        for (header, with_time) in [(HEADER, true), (HEADER.split_once(',').unwrap().1, false)] {
            let record = record_of(header, |row| {
                let time =
                    if with_time { format!("{},", row as f64 / 100.0) } else { String::new() };
                let (q, tau) = (field(row == 20, sine(row)), field((100..105).contains(&row), 1.0));
                format!("{time}{q},{tau}\n")
            })
            .unwrap();
            assert_eq!(parts(&record), [(0.0, 100), (1.05, 95)]);
            assert_eq!(record.resampled.interpolated_rows, 1);
            let error = record.segments[0].measurement.signals.position_rad[0][20] - sine(20);
            assert!(error.abs() < 1e-6, "{error}");
            let said = record.notes().join("; ");
            assert!(
                said.starts_with(
                    "6 of 200 rows lack a value, the first in line 22, column \
                `joint_position_rad_1`; they are no samples"
                ),
                "{said}"
            );
        }
        // Before a drive was on: no loss within.
        let late = record_of(HEADER, |row| {
            format!("{},{},{}\n", row as f64 / 100.0, sine(row), field(row < 7, 1.0))
        });
        let late = late.unwrap();
        assert_eq!(parts(&late), [(0.0, 193)]);
        assert_eq!(late.notes().len(), 1, "{:?}", late.notes());
    }

    #[test]
    #[expect(clippy::cast_precision_loss, reason = "rows")]
    fn signals_in_rows_of_their_own_are_refused_with_what_to_do() {
        let said = |row: &dyn Fn(usize) -> String| record_of(HEADER, row).unwrap_err().to_string();
        // Positions and torques by turns, half a period apart.
        let by_turns = said(&|row| {
            let (q, tau) = if row % 2 == 0 { ("1", "") } else { ("", "2") };
            format!("{},{q},{tau}\n", row as f64 / 200.0)
        });
        // A torque with every tenth position.
        let slower = said(&|row| {
            format!("{},1,{}\n", row as f64 / 100.0, if row % 10 == 0 { "2" } else { "NaN" })
        });
        for (said, parts) in [
            (
                by_turns,
                [
                    "200 of 200 rows lack a value, the first in line 2, column `joint_torque_nm_1`",
                    "`joint_position_rad_1` has 100 values and `joint_torque_nm_1` 100, 0 of them \
                    in the same rows",
                ],
            ),
            (
                slower,
                [
                    "180 of 200 rows lack a value, the first in line 3, column \
                    `joint_torque_nm_1`; they are no samples. The others are no record: 10.00 \
                    samples a second, and 100 are stated",
                    "column `joint_torque_nm_1` has 20 values and `joint_position_rad_1` 200, 20 \
                    of them in the same rows",
                ],
            ),
        ] {
            for part in parts.iter().chain(&["Put all on common times"]) {
                assert!(said.contains(part), "{said}");
            }
        }
    }

    fn of_others(names: &[&str], scale: f64) -> AxisColumns {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        AxisColumns { names, scales: vec![scale, -scale], zeros: Vec::new(), wraps: Vec::new() }
    }

    #[test]
    fn a_table_says_when_it_was_recorded_where_its_times_have_a_date() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let start = |time: Option<TimeColumns>, names: &str, rows: &[&str]| {
            let single = |name: &str| AxisColumns {
                names: vec![name.into()],
                scales: vec![1.0],
                zeros: Vec::new(),
                wraps: Vec::new(),
            };
            let (side, axes, reference) = (Side::Joint, 1, None);
            let (position, torque) = (single("q"), single("f"));
            let columns = Columns { side, axes, time, position, torque, reference };
            let rows: String = rows.iter().map(|row| format!("{row},1,2\n")).collect();
            std::fs::write(&path, format!("{names},q,f\n{rows}")).unwrap();
            let rate_hz = columns.time.is_none().then_some(100.0);
            let record = read_table(&path, rate_hz, 100.0, Some(&columns)).unwrap();
            RecordingStart::display_text(record.recording_start)
        };
        let numbers = |second| Some(TimeColumns::Numbers { column: "t".into(), second });
        let dates = || Some(TimeColumns::Dates { column: "t".into() });
        let parts = Some(TimeColumns::Parts { sec: "s".into(), nanosec: "ns".into() });
        let expected_start = "2024-05-01 12:00:00.250 UTC";
        for (time, names, rows, expected) in [
            (
                numbers(1.0),
                "t",
                ["1714564800.2501", "1714564800.2601", "1714564800.2701"],
                expected_start,
            ),
            (
                numbers(1e-9),
                "t",
                ["1714564800250400000", "1714564800260400000", "1714564800270400000"],
                expected_start,
            ),
            (numbers(1.0), "t", ["0", "0.01", "0.02"], "not known"),
            (numbers(1e-3), "t", ["86400000", "86400010", "86400020"], "not known"),
            (
                dates(),
                "t",
                [
                    "2024-05-01T14:00:00.25+02:00",
                    "2024-05-01T12:00:00.26Z",
                    "2024-05-01T12:00:00.27Z",
                ],
                expected_start,
            ),
            // The clock is unknown.
            (
                dates(),
                "t",
                ["2024-05-01T12:00:00.25", "2024-05-01T12:00:00.26", "2024-05-01T12:00:00.27"],
                "not known",
            ),
            (
                parts,
                "s,ns",
                ["1714564800,250400000", "1714564800,260400000", "1714564800,270400000"],
                expected_start,
            ),
            (None, "t", ["1714564800", "1714564801", "1714564802"], "not known"),
        ] {
            assert_eq!(start(time, names, &rows), expected, "{rows:?}");
        }
    }

    /// Columns of one axis.
    fn one_axis(time: &str, [position, torque]: [&str; 2]) -> Columns {
        let single = |name: &str| AxisColumns {
            names: vec![name.into()],
            scales: vec![1.0],
            zeros: Vec::new(),
            wraps: Vec::new(),
        };
        Columns {
            side: Side::Joint,
            axes: 1,
            time: Some(TimeColumns::Numbers { column: time.into(), second: 1.0 }),
            position: single(position),
            torque: single(torque),
            reference: None,
        }
    }

    /// The same two rows in the forms in which people have them.
    #[test]
    fn every_layout_of_a_text_is_the_same_table() {
        let named = one_axis("t", ["q", "tau"]);
        let by_number = one_axis("1", ["2", "3"]);
        let of_lists = one_axis("t", ["s[0]", "s[1]"]);
        let cases: [(&str, &Columns, u64); 18] = [
            ("t,q,tau\n0,1.5,-2\n0.5,3,4\n", &named, 2),
            ("t\tq\ttau\n0\t1.5\t-2\n0.5\t3\t4\n", &named, 2),
            ("t q tau\n0 1.5 -2\n0.5 3 4\n", &named, 2),
            ("  t   q   tau\n  0   1.5  -2\n  0.5 3    4\n", &named, 2),
            ("# t q tau\n0 1.5 -2\n0.5 3 4\n", &named, 2),
            ("#t,q,tau\n0,1.5,-2\n# a note\n0.5,3,4\n", &named, 2),
            ("% t;q;tau\n0;1,5;-2\n0,5;3;4\n", &named, 2),
            ("\"t\",\"q\",\"tau\"\n\"0\",\"1,5\",\"-2\"\n\"0,5\",\"3\",\"4\"\n", &named, 2),
            ("t;q;tau\ns;rad;Nm\n0;1.5;-2\n0.5;3;4\n", &named, 3),
            ("File;x.svd\nStart;1335\n\nt;q;tau\n0;1,5;-2\n0,5;3;4\n", &named, 5),
            ("0,1.5,-2\n0.5,3,4\n", &by_number, 1),
            (",0,1,2\n0,0,1.5,-2\n1,0.5,3,4\n", &one_axis("0", ["1", "2"]), 2),
            ("0 1.5 -2\r\n0.5 3 4\r\n", &by_number, 1),
            ("t,q,q\n0,1.5,-2\n0.5,3,4\n", &one_axis("t", ["2", "3"]), 2),
            ("t,s\n0,\"[1.5, -2.0]\"\n0.5,\"[3, 4]\"\n", &of_lists, 2),
            ("t,s\n0,[1.5 -2.]\n0.5,[3. 4.]\n", &of_lists, 2),
            ("t,q,tau,\n0,1.5,-2\n0.5,3,4,\n", &named, 2),
            ("t,q,tau,mode\n0,1.5,-2,auto\n0.5,3,4,auto\n", &named, 2),
        ];
        for (text, columns, first_line) in cases {
            let read = read_complete(text.as_bytes(), None, Some(columns));
            let signals = read.unwrap_or_else(|error| panic!("{text}: {error}")).signals;
            assert_eq!(signals.position_rad, [[1.5, 3.0]], "{text}");
            assert_eq!(signals.torque_nm, [[-2.0, 4.0]], "{text}");
            assert!((signals.sample_rate_hz - 2.0).abs() < 1e-12, "{text}");
            let input = Box::new(std::io::Cursor::new(text.as_bytes().to_vec()));
            let table = TextTable::open(input, Path::new("x.csv"), &[]).unwrap();
            assert_eq!(table.first_row(), RowPlace::Line(first_line), "{text}");
        }
    }

    #[test]
    fn what_is_wrong_in_a_layout_is_named_with_its_line() {
        let named = one_axis("t", ["q", "tau"]);
        let refused = |text: &str| {
            read_complete(text.as_bytes(), None, Some(&named)).expect_err("must be refused")
        };
        // Decimal commas that also separate the fields.
        let error = refused("t,q,tau\n0,0,1,5,-2,1\n0,5,3,1,4,1\n");
        let TableError::FieldCount { line, found, expected, header_line, .. } = error else {
            panic!("{error}")
        };
        assert_eq!((line, found, expected, header_line), (2, 6, 3, Some(1)));
        let error = refused("t;q;tau\ns;rad;Nm\n\n0;1.5;-2\n0.5;x;4\n");
        let TableError::NotANumber { place, column, .. } = error else { panic!("{error}") };
        assert_eq!((place, column.as_str()), (RowPlace::Line(5), "q"));
        let error = refused("t,q,tau,q,q\n0,1,2,3,4\n1,1,2,3,4\n");
        let TableError::DuplicateColumn { column, numbers, .. } = error else { panic!("{error}") };
        assert_eq!((column.as_str(), numbers.as_str()), ("q", "2, 4, 5"));
        let bomb = "0".repeat(3 << 20);
        let error = refused(&format!("t,q,tau\n0,1,2\n{bomb}"));
        assert!(matches!(error, TableError::LongLine { line: 3, .. }), "{error}");
    }

    /// The cause is named, and not what follows from it.
    #[test]
    fn a_wrong_unit_of_the_time_and_a_missing_header_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let rows: String = (0..200).map(|row| format!("{},{row},0\n", 10 * row)).collect();
        std::fs::write(&path, format!("t,q,tau\n{rows}")).unwrap();
        let columns = one_axis("t", ["q", "tau"]);
        let error = read_table(&path, Some(100.0), 100.0, Some(&columns)).unwrap_err();
        let TableError::TimeScale { second, .. } = error else { panic!("{error}") };
        assert!((second - 1e-3).abs() < 1e-12);
        std::fs::write(&path, rows).unwrap();
        let error = read_table(&path, Some(100.0), 100.0, Some(&columns)).unwrap_err();
        assert!(matches!(error, TableError::NoHeader { .. }), "{error}");
    }

    /// 600 rows of 100 Hz, two recordings of 300.
    #[test]
    fn recordings_one_after_another_are_pieces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let columns = one_axis("t", ["q", "tau"]);
        let row = |row: i32| format!("{:.2},{row},{}\n", f64::from(row) / 100.0, row % 7);
        let recording: String = (0..300).map(row).collect();
        for again in ["", "t,q,tau\n"] {
            std::fs::write(&path, format!("t,q,tau\n{recording}{again}{recording}")).unwrap();
            let record = read_table(&path, Some(100.0), 100.0, Some(&columns)).unwrap();
            let samples = |piece: &crate::record::Piece| piece.measurement.samples();
            assert_eq!(record.segments.iter().map(samples).collect::<Vec<_>>(), [300, 300]);
            assert_eq!(record.resampled.appended_recordings, 1);
        }
        let without_times = Columns { time: None, ..columns };
        let record = read_table(&path, Some(100.0), 100.0, Some(&without_times)).unwrap();
        assert_eq!((record.segments.len(), record.resampled.appended_recordings), (2, 1));
    }

    /// 600 rows of 100 Hz, between which the clock was set back; times as MATLAB writes them.
    #[test]
    fn a_clock_step_cuts_and_durations_are_times() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let columns = one_axis("t", ["q", "tau"]);
        let row = |row: i32| {
            let time_s = f64::from(row) / 100.0 - if row < 300 { 0.0 } else { 0.5 };
            format!("{time_s:.2} sec,{row},{}\n", row % 7)
        };
        let text = "t,q,tau\n".to_owned() + &(0..600).map(row).collect::<String>();
        std::fs::write(&path, &text).unwrap();
        let record = read_table(&path, Some(100.0), 100.0, Some(&columns)).unwrap();
        let samples = |piece: &crate::record::Piece| piece.measurement.samples();
        assert_eq!(record.segments.iter().map(samples).collect::<Vec<_>>(), [300, 300]);
        let Resampled { clock_steps, appended_recordings, largest_s, .. } = record.resampled;
        assert_eq!((clock_steps, appended_recordings), (1, 0));
        assert!(largest_s < 1e-9, "{largest_s}");
        assert_eq!(list_table(&path).unwrap().seconds_per_unit, [Some(1.0), None, None]);
        // The same in UTF-16.
        let units = core::iter::once(0xfeff).chain(text.encode_utf16());
        std::fs::write(&path, units.flat_map(u16::to_le_bytes).collect::<Vec<u8>>()).unwrap();
        let wide = read_table(&path, Some(100.0), 100.0, Some(&columns)).unwrap();
        assert_eq!(wide.segments, record.segments);
    }

    /// The first bytes of packet captures, old and new.
    #[test]
    fn a_binary_file_is_no_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let pcap = b"\xd4\xc3\xb2\xa1\x02\0\x04\0\0\0t,q,tau\n";
        for bytes in [&pcap[..], b"\n\r\r\n\x1c\0\0\0\x4d\x3c\x2b\x1at,q,tau\n"] {
            std::fs::write(&path, bytes).unwrap();
            let error = list_table(&path).unwrap_err();
            assert!(matches!(error, TableError::Binary { .. }), "{error}");
        }
    }

    /// States of 125 Hz in rows of 500 Hz, and stamps of two decimals.
    #[test]
    fn a_log_that_is_faster_than_the_arm_or_its_stamps_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let columns = one_axis("t", ["q", "tau"]);
        fn table(decimals: usize, rows_per_state: u32) -> String {
            let row = |row: u32| {
                let state = f64::from(row / rows_per_state);
                let time = f64::from(row) / 500.0;
                format!("{time:.decimals$},{},{}\n", (0.01 * state).sin(), state % 7.0)
            };
            "t,q,tau\n".to_owned() + &(0..4000).map(row).collect::<String>()
        }
        std::fs::write(&path, table(4, 4)).unwrap();
        let error = read_table(&path, Some(500.0), 500.0, Some(&columns)).unwrap_err();
        let TableError::Times { source: TimesError::RepeatedStates { rows, found_hz, .. }, .. } =
            error
        else {
            panic!("{error}")
        };
        assert!(rows == 4 && (found_hz - 125.0).abs() < 0.1, "{rows} {found_hz}");
        let record = read_table(&path, Some(125.0), 125.0, Some(&columns)).unwrap();
        assert_eq!(record.resampled.rows_per_state, 4);
        assert_eq!(record.segments[0].measurement.samples(), 1000);
        std::fs::write(&path, table(2, 1)).unwrap();
        let record = read_table(&path, Some(500.0), 500.0, Some(&columns)).unwrap();
        assert!((record.resampled.coarse_step_s - 0.01).abs() < 1e-9);
        assert_eq!(record.into_whole().unwrap().samples(), 4000);
    }

    #[test]
    fn angles_that_wrap_are_unwrapped() {
        let mut columns = one_axis("t", ["q", "tau"]);
        columns.position.wraps = vec![true];
        columns.position.scales = vec![1f64.to_radians()];
        let angle = |row: u32| 30.0 * f64::from(row) - 100.0;
        let rows: String =
            (0..40).map(|row: u32| format!("{row},{},0\n", angle(row).rem_euclid(360.0))).collect();
        let read = read_complete(format!("t,q,tau\n{rows}").as_bytes(), None, Some(&columns));
        let signals = read.unwrap().signals;
        for (row, position) in (0u32..).zip(&signals.position_rad[0]) {
            assert!((position - angle(row).to_radians()).abs() < 1e-9, "{position}");
        }
    }

    #[test]
    fn columns_of_others_are_read_by_name_unit_and_sign() {
        let columns = Columns {
            side: Side::Joint,
            axes: 2,
            time: Some(TimeColumns::Numbers { column: "t".into(), second: 1e-3 }),
            position: of_others(&["actual_q_{index}"], 0.5),
            torque: of_others(&["tau_{axis}"], 1.0),
            reference: Some(of_others(&["goal", "aim"], 1.0)),
        };
        let read = |text: &str| read_complete(text.as_bytes(), None, Some(&columns));
        let header = "t;actual_q_1;actual_q_0;mode;tau_1;tau_2;aim;goal\n";
        let table = format!("{header}0;1;2;auto;3;4;5;6\n10;1,5;2;auto;3;4;5;6\n");
        for table in
            [table.clone(), table.replace(';', "\t"), table.replace(',', ".").replace(';', ",")]
        {
            let signals = read(&table).unwrap().signals;
            assert!((signals.sample_rate_hz - 100.0).abs() < 1e-9);
            assert_eq!(signals.position_rad, [[1.0, 1.0], [-0.5, -0.75]]);
            assert_eq!(signals.torque_nm, [[3.0, 3.0], [-4.0, -4.0]]);
            assert_eq!(signals.reference_rad.unwrap(), [[6.0, 6.0], [-5.0, -5.0]]);
        }
        let said = |text: &str| read(text).unwrap_err().to_string();
        let missing = said(&table.replace("tau_2", "tau_3"));
        assert!(
            missing.contains("column `tau_2` is missing; the header has t actual_q_1"),
            "{missing}"
        );
        assert!(said(&table.replace("mode", "tau_1")).contains("`tau_1`"));
        assert!(said(&table.replace("1,5", "x")).contains("line 3, column `actual_q_1`: `x`"));
    }
}
