//! CSV experiments: a header, one row per sample.
//!
//! didim's own have SI units in the names: `time_s` (optional when the sample rate is given), then
//! `motor_position_rad_1..n`, `motor_torque_nm_1..n` and optionally `motor_reference_rad_1..n`; or the same with
//! `joint_`. Those of others are read by the names and units of their [`Columns`]. Fields are separated by commas,
//! semicolons or tabs; where not by commas, a number may have a decimal comma.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use didim_core::identification::Signals;
use flate2::bufread::MultiGzDecoder;

use crate::columns::{Columns, Quantity};
use crate::measurement::{MAX_SAMPLES, Measurement, RATE_TOLERANCE, Side};
use crate::record::Record;
use crate::uniform::{Rows, TimesError, resample};

/// The largest part of a sample period by which a time stamp may leave the uniform grid.
const GRID_TOLERANCE: f64 = 0.25;

/// Why a CSV experiment could not be read or written. Every variant names the file and, where there
/// is one, the line.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    /// The file cannot be opened, read or written: check path and permissions.
    #[error("{}: {source}; check the path and the permissions", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not a CSV table, or a row with another number of fields than the header.
    #[error("{}: {source}", file.display())]
    Table {
        /// The file.
        file: PathBuf,
        /// What the parser said, with the line.
        source: csv::Error,
    },
    /// A header name that the format does not know: rename or remove the column.
    #[error("{}: column `{column}` is not known; expected time_s and motor_position_rad_1, motor_torque_nm_1, motor_reference_rad_1 and so on, or the same with joint_", file.display())]
    UnknownColumn {
        /// The file.
        file: PathBuf,
        /// The header name.
        column: String,
    },
    /// One column for two signals.
    #[error("{}: column `{column}` is asked for twice; name each column once", file.display())]
    AskedTwice {
        /// The file.
        file: PathBuf,
        /// The column.
        column: String,
    },
    /// Columns that were asked for are missing or there twice.
    #[error("{}: column `{column}` is missing or appears twice; the header has {known}", file.display())]
    NoSuchColumn {
        /// The file.
        file: PathBuf,
        /// The column that is expected exactly once.
        column: String,
        /// Those there are.
        known: String,
    },
    /// Columns of one quantity are missing, repeated or numbered with gaps.
    #[error("{}: column `{column}` is missing or appears twice; every axis from 1 to {axes} needs one", file.display())]
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
    /// A field that is not a finite number.
    #[error("{}: line {line}, column `{column}`: `{text}` is not a finite number", file.display())]
    NotANumber {
        /// The file.
        file: PathBuf,
        /// The line, the header being line 1.
        line: u64,
        /// The column's header name.
        column: String,
        /// What stands there.
        text: String,
    },
    /// Neither a `time_s` column nor a sample rate was given: give one of them.
    #[error("{}: there is no time_s column; give the sampling frequency with --sample-rate HZ", file.display())]
    NoTime {
        /// The file.
        file: PathBuf,
    },
    /// The times of the rows are none of a record.
    #[error("{}: {source}", file.display())]
    Times {
        /// The file.
        file: PathBuf,
        /// What is wrong with them.
        source: TimesError,
    },
    /// Time does not advance by one period per row: samples are missing or repeated there.
    #[error("{}: line {line}: time_s = {time_s} leaves the uniform grid of {sample_rate_hz:.6} Hz (expected {expected_s:.9}); samples are missing or repeated", file.display())]
    NotUniform {
        /// The file.
        file: PathBuf,
        /// The line, the header being line 1.
        line: u64,
        /// The time that stands there \[s\].
        time_s: f64,
        /// The time that the grid has there \[s\].
        expected_s: f64,
        /// The grid's frequency \[Hz\].
        sample_rate_hz: f64,
    },
    /// The rate that was given and the file's own differ by more than [`RATE_TOLERANCE`], as far as its
    /// times tell: drop one of them.
    #[error("{}: the times say {found_hz:.6} Hz and {given_hz} Hz are stated; correct --sample-rate or data.rate_hz, or leave the option out", file.display())]
    RateMismatch {
        /// The file.
        file: PathBuf,
        /// The rate of the time column \[Hz\].
        found_hz: f64,
        /// The rate that was given \[Hz\].
        given_hz: f64,
    },
    /// More samples than are held in memory: cut the measurement.
    #[error("{}: more than {MAX_SAMPLES} samples, the most that is held in memory; cut the measurement", file.display())]
    TooLong {
        /// The file.
        file: PathBuf,
    },
    /// Fewer than two rows.
    #[error("{}: fewer than two samples", file.display())]
    TooShort {
        /// The file.
        file: PathBuf,
    },
}

/// What one column of the file holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Column {
    Time,
    Signal(Quantity, usize),
    /// Nothing that is asked for.
    Other,
}

/// Reads a whole experiment with didim's own columns, its times on a uniform grid.
///
/// `sample_rate_hz` replaces a missing time column; when both are there they must agree.
///
/// # Errors
/// See [`CsvError`].
pub fn read_csv(path: &Path, sample_rate_hz: Option<f64>) -> Result<Measurement, CsvError> {
    let table = parse(text(path)?, path, sample_rate_hz.is_none(), None)?;
    let grid = grid(&table, sample_rate_hz, path)?;
    Ok(table.measurement(grid.rate_hz))
}

/// Reads a table of didim's own columns, or of others. Times that jitter are resampled to `nominal_hz`, and cut where samples are
/// missing.
///
/// `sample_rate_hz` replaces a missing time column; when both are there they must agree.
///
/// # Errors
/// See [`CsvError`].
pub fn read_table(
    path: &Path,
    sample_rate_hz: Option<f64>,
    nominal_hz: f64,
    columns: Option<&Columns>,
) -> Result<Record, CsvError> {
    let mut table = parse(text(path)?, path, sample_rate_hz.is_none(), columns)?;
    let Table { side, axes, resolution_s, .. } = table;
    // Off the grid by more than the digits that they are written with, times jitter.
    match grid(&table, sample_rate_hz, path) {
        Ok(Grid { rate_hz, off_s }) if off_s <= (2.0 * resolution_s).max(STILL / rate_hz) => {
            Ok(table.measurement(rate_hz).into())
        }
        Ok(_) | Err(CsvError::NotUniform { .. }) => {
            let times_s = table.time.take().unwrap_or_default();
            let columns = table.signals.iter_mut().flat_map(core::mem::take).collect();
            let rate = sample_rate_hz.unwrap_or(nominal_hz);
            let uniform = resample(Rows { times_s, columns }, rate)
                .map_err(|source| CsvError::Times { file: path.to_path_buf(), source })?;
            Ok(Record::resampled(uniform, |columns| {
                let mut columns = columns.into_iter();
                let signals = [(); 3].map(|()| columns.by_ref().take(axes).collect());
                Table { side, axes, time: None, resolution_s, signals }.measurement(rate)
            }))
        }
        Err(error) => Err(error),
    }
}

/// A header beyond that is none \[bytes\].
const LONGEST_HEADER: u64 = 1 << 20;

/// The first bytes of what gzip compressed (RFC 1952).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The text of a file, decompressed where gzip compressed it.
fn text(path: &Path) -> Result<Box<dyn BufRead>, CsvError> {
    let wrong = |source| CsvError::Io { file: path.to_path_buf(), source };
    let mut file = BufReader::new(std::fs::File::open(path).map_err(wrong)?);
    if file.fill_buf().map_err(wrong)?.starts_with(&GZIP) {
        return Ok(Box::new(BufReader::new(MultiGzDecoder::new(file))));
    }
    Ok(Box::new(file))
}

/// The header of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TableNames {
    /// Its columns.
    pub columns: Vec<String>,
    /// The side of the transmission and whether there is a time, where all columns are didim's own.
    pub own: Option<(Side, bool)>,
}

/// Reads the header of a table.
///
/// # Errors
/// See [`CsvError`].
pub fn list_table(path: &Path) -> Result<TableNames, CsvError> {
    let (_, columns, _) = open(text(path)?, path, None)?;
    let own = Header::parse(&columns, path).ok().map(|header| (header.side, header.has_time));
    Ok(TableNames { columns, own })
}

/// Reads a table without asking for a rate: its rows as they come.
///
/// # Errors
/// See [`CsvError`].
pub fn read_rows(path: &Path, columns: Option<&Columns>) -> Result<Table, CsvError> {
    parse(text(path)?, path, false, columns)
}

/// A table as it stands in the file, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    side: Side,
    axes: usize,
    /// The time of each row, where there is one \[s\].
    pub time: Option<Vec<f64>>,
    /// What the last digit of the finest of them is worth \[s\].
    resolution_s: f64,
    /// Positions, torques and references by axis; no references where there are none.
    pub signals: [Vec<Vec<f64>>; 3],
}

/// Times that are off the grid by less of a period are on it for whoever derives positions.
const STILL: f64 = 0.01;

impl Table {
    fn measurement(self, sample_rate_hz: f64) -> Measurement {
        let [position_rad, torque_nm, reference] = self.signals;
        let reference_rad = (!reference.is_empty()).then_some(reference);
        let signals = Signals { sample_rate_hz, position_rad, torque_nm, reference_rad };
        Measurement { side: self.side, rate_unchecked: false, signals }
    }
}

/// What separates the fields of a header line: that with which most of the wanted columns are there, or with which there are most
/// fields.
fn separator(line: &[u8], columns: Option<&Columns>) -> u8 {
    let wanted: Vec<String> = match columns {
        Some(columns) => {
            let names = Quantity::ALL.into_iter().flat_map(|quantity| columns.names(quantity));
            names.chain(columns.time_name().map(str::to_owned)).collect()
        }
        None => Vec::new(),
    };
    let fields = |separator: u8| -> (usize, usize) {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .delimiter(separator)
            .from_reader(line);
        let Some(Ok(record)) = reader.records().next() else { return (0, 0) };
        let found = record.iter().filter(|field| wanted.iter().any(|name| name == field));
        (found.count(), record.len())
    };
    // The last of several equal ones is a comma.
    [b'\t', b';', b','].into_iter().max_by_key(|separator| fields(*separator)).unwrap_or(b',')
}

/// A reader behind the header, its names and what separates them.
fn open<R: BufRead>(
    mut input: R,
    path: &Path,
    columns: Option<&Columns>,
) -> Result<(csv::Reader<impl Read>, Vec<String>, u8), CsvError> {
    let file = || path.to_path_buf();
    let mut begin = Vec::new();
    (&mut input)
        .take(LONGEST_HEADER)
        .read_until(b'\n', &mut begin)
        .map_err(|source| CsvError::Io { file: file(), source })?;
    let delimiter = separator(&begin, columns);
    let input = std::io::Cursor::new(begin).chain(input);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).delimiter(delimiter).from_reader(input);
    let header = reader.headers().map_err(|source| CsvError::Table { file: file(), source })?;
    let names = header.iter().map(str::to_owned).collect();
    Ok((reader, names, delimiter))
}

fn parse(
    input: impl BufRead,
    path: &Path,
    needs_time: bool,
    columns: Option<&Columns>,
) -> Result<Table, CsvError> {
    let file = || path.to_path_buf();
    let (mut reader, names, delimiter) = open(input, path, columns)?;
    let header = match columns {
        None => Header::parse(&names, path)?,
        Some(columns) => Header::of_columns(&names, columns, path)?,
    };

    if needs_time && !header.has_time {
        return Err(CsvError::NoTime { file: file() });
    }

    let (mut time, mut resolution_s) = (Vec::new(), f64::INFINITY);
    let mut signals: [Vec<Vec<f64>>; 3] = std::array::from_fn(|_| vec![Vec::new(); header.axes]);
    if !header.has_reference {
        signals[Quantity::Reference as usize].clear();
    }
    let mut record = csv::StringRecord::new();
    let mut rows = 0;
    while reader
        .read_record(&mut record)
        .map_err(|source| CsvError::Table { file: file(), source })?
    {
        if rows == MAX_SAMPLES {
            return Err(CsvError::TooLong { file: file() });
        }
        rows += 1;
        for ((column, name), text) in header.columns.iter().zip(&names).zip(record.iter()) {
            if *column == Column::Other {
                continue;
            }
            let point = (delimiter != b',' && text.contains(',')).then(|| text.replace(',', "."));
            let number = point.as_deref().unwrap_or(text).parse::<f64>();
            let value =
                number.ok().filter(|v| v.is_finite()).ok_or_else(|| CsvError::NotANumber {
                    file: file(),
                    line: record.position().map_or(0, csv::Position::line),
                    column: name.clone(),
                    text: text.to_owned(),
                })?;
            match *column {
                Column::Time => {
                    let scale = columns.map_or(1.0, Columns::time_scale);
                    time.push(value * scale);
                    resolution_s = resolution_s.min(scale * resolution(text));
                }
                Column::Signal(quantity, axis) => {
                    let scale = columns.map_or(1.0, |columns| columns.scale(quantity, axis));
                    signals[quantity as usize][axis].push(value * scale);
                }
                Column::Other => {}
            }
        }
    }
    if rows < 2 {
        return Err(CsvError::TooShort { file: file() });
    }
    let time = header.has_time.then_some(time);
    Ok(Table { side: header.side, axes: header.axes, time, resolution_s, signals })
}

/// What the last digit of a number is worth.
fn resolution(number: &str) -> f64 {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let decimals = mantissa.split_once(['.', ',']).map_or(0, |(_, decimals)| decimals.len());
    let decimals = i32::try_from(decimals).unwrap_or(i32::MAX);
    exponent.parse::<i32>().map_or(0.0, |exponent| 10f64.powi(exponent.saturating_sub(decimals)))
}

/// A uniform grid of times.
struct Grid {
    rate_hz: f64,
    /// How far a time is off it at most \[s\].
    off_s: f64,
}

/// The grid of a table whose times, if any, are on a uniform one.
fn grid(table: &Table, given: Option<f64>, path: &Path) -> Result<Grid, CsvError> {
    let file = || path.to_path_buf();
    let Some(time) = &table.time else {
        let rate_hz = given.ok_or(CsvError::NoTime { file: file() })?;
        return Ok(Grid { rate_hz, off_s: 0.0 });
    };
    let Grid { rate_hz: found_hz, off_s } = uniform(time, path)?;
    let Some(given_hz) = given else { return Ok(Grid { rate_hz: found_hz, off_s }) };
    // By what share rounded times let the rate be off.
    let lasts_s = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first);
    if (found_hz / given_hz - 1.0).abs() > RATE_TOLERANCE + 2.0 * off_s / lasts_s {
        return Err(CsvError::RateMismatch { file: file(), found_hz, given_hz });
    }
    Ok(Grid { rate_hz: given_hz, off_s })
}

/// The grid of a uniform time column; an error at the first row that leaves it.
///
/// The grid runs from the first to the last time, so that the decimals a writer dropped do not
/// accumulate. Where that does not fit, a gap has stretched it: the median step, which a gap does
/// not move, then tells where.
#[expect(clippy::cast_precision_loss, reason = "rows are far fewer than 2^52")]
fn uniform(time_s: &[f64], path: &Path) -> Result<Grid, CsvError> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else {
        return Err(CsvError::TooShort { file: path.to_path_buf() });
    };
    let distances = |period: f64| {
        let rows = time_s.iter().enumerate();
        rows.map(move |(row, time)| (time - (first + row as f64 * period)).abs())
    };
    let leaves_grid = |period: f64| {
        distances(period).position(|is| period <= 0.0 || is > GRID_TOLERANCE * period)
    };
    let mean = (last - first) / (time_s.len() - 1) as f64;
    if leaves_grid(mean).is_none() {
        let off_s = distances(mean).fold(0.0, f64::max);
        return Ok(Grid { rate_hz: 1.0 / mean, off_s });
    }
    let mut steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let median = steps[steps.len() / 2];
    let row = leaves_grid(median).unwrap_or(time_s.len() - 1);
    Err(CsvError::NotUniform {
        file: path.to_path_buf(),
        line: row as u64 + 2,
        time_s: time_s[row],
        expected_s: first + row as f64 * median,
        sample_rate_hz: 1.0 / median,
    })
}

struct Header {
    side: Side,
    axes: usize,
    columns: Vec<Column>,
    has_time: bool,
    has_reference: bool,
}

impl Header {
    fn parse(names: &[String], path: &Path) -> Result<Self, CsvError> {
        let file = || path.to_path_buf();
        let mut sides = Vec::new();
        let mut columns = Vec::with_capacity(names.len());
        for name in names {
            let (side, column) = parse_name(name)
                .ok_or_else(|| CsvError::UnknownColumn { file: file(), column: name.clone() })?;
            sides.extend(side);
            columns.push(column);
        }
        let side = sides.first().copied().unwrap_or(Side::Motor);
        if sides.iter().any(|s| *s != side) {
            return Err(CsvError::MixedSides { file: file() });
        }
        let axes = columns
            .iter()
            .map(|c| if let Column::Signal(_, axis) = c { axis + 1 } else { 0 })
            .max()
            .unwrap_or(0)
            .max(1);
        let count = |wanted: Column| columns.iter().filter(|c| **c == wanted).count();
        let has_reference =
            columns.iter().any(|c| matches!(c, Column::Signal(Quantity::Reference, _)));
        for quantity in Quantity::ALL {
            if quantity == Quantity::Reference && !has_reference {
                continue;
            }
            for axis in 0..axes {
                if count(Column::Signal(quantity, axis)) != 1 {
                    let column = column_name(side, quantity, axis);
                    return Err(CsvError::Columns { file: file(), column, axes });
                }
            }
        }
        let times = count(Column::Time);
        if times > 1 {
            return Err(CsvError::Columns { file: file(), column: "time_s".into(), axes });
        }
        Ok(Self { side, axes, columns, has_time: times == 1, has_reference })
    }
}

/// Names that an error lists.
const LISTED: usize = 24;

impl Header {
    /// Those of other programs, by their names; what is not asked for is passed over.
    fn of_columns(names: &[String], wanted: &Columns, path: &Path) -> Result<Self, CsvError> {
        let mut columns = vec![Column::Other; names.len()];
        let mut set = |name: &str, column: Column| {
            let mut found = names.iter().enumerate().filter(|(_, own)| *own == name);
            match (found.next(), found.next()) {
                (Some((index, _)), None) if columns[index] != Column::Other => {
                    let (file, column) = (path.to_path_buf(), name.to_owned());
                    Err(CsvError::AskedTwice { file, column })
                }
                (Some((index, _)), None) => {
                    columns[index] = column;
                    Ok(())
                }
                _ => {
                    let more = if names.len() > LISTED { " …" } else { "" };
                    let known = names.iter().take(LISTED).map(String::as_str);
                    let known = known.collect::<Vec<_>>().join(" ") + more;
                    let (file, column) = (path.to_path_buf(), name.to_owned());
                    Err(CsvError::NoSuchColumn { file, column, known })
                }
            }
        };
        if let Some(time) = wanted.time_name() {
            set(time, Column::Time)?;
        }
        for quantity in Quantity::ALL {
            let given = wanted.names(quantity);
            if given.len() > wanted.axes {
                let column = given.last().cloned().unwrap_or_default();
                let (file, axes) = (path.to_path_buf(), wanted.axes);
                return Err(CsvError::Columns { file, column, axes });
            }
            for (axis, name) in given.into_iter().enumerate() {
                set(&name, Column::Signal(quantity, axis))?;
            }
        }
        Ok(Self {
            side: wanted.side,
            axes: wanted.axes,
            columns,
            has_time: wanted.time_name().is_some(),
            has_reference: !wanted.names(Quantity::Reference).is_empty(),
        })
    }
}

fn parse_name(name: &str) -> Option<(Option<Side>, Column)> {
    if name == "time_s" {
        return Some((None, Column::Time));
    }
    let (side, rest) = [Side::Motor, Side::Joint].into_iter().find_map(|side| {
        name.strip_prefix(side.prefix())?.strip_prefix('_').map(|rest| (side, rest))
    })?;
    let (stem, number) = rest.rsplit_once('_')?;
    let quantity = Quantity::ALL.into_iter().find(|q| q.stem() == stem)?;
    let axis: usize = number.parse().ok()?;
    let known = (1..=didim_core::MAX_JOINTS).contains(&axis);
    known.then_some((Some(side), Column::Signal(quantity, axis - 1)))
}

fn column_name(side: Side, quantity: Quantity, axis: usize) -> String {
    format!("{}_{}_{}", side.prefix(), quantity.stem(), axis + 1)
}

/// Writes a measurement as CSV, with a `time_s` column that starts at 0. Numbers have as many digits
/// as it takes to read the same value back.
///
/// # Errors
/// [`CsvError::Io`] or [`CsvError::Table`] when the file cannot be written.
pub fn write_csv(measured: &Measurement, output: impl Write, path: &Path) -> Result<(), CsvError> {
    let table = |source| CsvError::Table { file: path.to_path_buf(), source };
    let mut writer = csv::Writer::from_writer(output);
    let blocks: Vec<(Quantity, &Vec<Vec<f64>>)> = [
        (Quantity::Position, Some(&measured.signals.position_rad)),
        (Quantity::Torque, Some(&measured.signals.torque_nm)),
        (Quantity::Reference, measured.signals.reference_rad.as_ref()),
    ]
    .into_iter()
    .filter_map(|(quantity, block)| block.map(|b| (quantity, b)))
    .collect();

    let mut names = vec!["time_s".to_owned()];
    for (quantity, block) in &blocks {
        names.extend((0..block.len()).map(|axis| column_name(measured.side, *quantity, axis)));
    }
    writer.write_record(&names).map_err(table)?;
    let mut row = Vec::with_capacity(names.len());
    for k in 0..measured.samples() {
        row.clear();
        #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
        row.push((k as f64 / measured.signals.sample_rate_hz).to_string());
        row.extend(blocks.iter().flat_map(|(_, b)| b.iter().map(|axis| axis[k].to_string())));
        writer.write_record(&row).map_err(table)?;
    }
    writer.flush().map_err(|source| CsvError::Io { file: path.to_path_buf(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::AxisColumns;

    fn whole(
        text: &[u8],
        given: Option<f64>,
        columns: Option<&Columns>,
    ) -> Result<Measurement, CsvError> {
        let path = Path::new("x.csv");
        let table = parse(text, path, given.is_none(), columns)?;
        let grid = grid(&table, given, path)?;
        Ok(table.measurement(grid.rate_hz))
    }

    fn of_text(text: &str, rate: Option<f64>) -> Result<Measurement, CsvError> {
        whole(text.as_bytes(), rate, None)
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
        let read = whole(&bytes, Some(5000.0), None).unwrap();
        assert_eq!(read, measurement);
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
            (format!("{HEADER}0,1,2\n0.1,NaN,2\n"), "line 3, column `joint_position_rad_1`: `NaN`"),
            (format!("{HEADER}0,1,2\n0.1,1\n"), "line: 3"),
            ("time_s,joint_position_deg_1\n".into(), "`joint_position_deg_1` is not known"),
            ("joint_position_rad_9,time_s\n".into(), "`joint_position_rad_9` is not known"),
            ("time_s,joint_position_rad_1\n".into(), "`joint_torque_nm_1` is missing"),
            ("motor_position_rad_1,joint_torque_nm_1\n".into(), "mixes motor_ and joint_"),
            (format!("{HEADER}0,1,2\n"), "fewer than two"),
            (format!("{HEADER}0,1,2\n0,1,2\n"), "leaves the uniform grid"),
        ];
        for (text, expected) in cases {
            let found = message(&text, None);
            assert!(found.starts_with("x.csv: ") || found.contains(expected), "{found}");
            assert!(found.contains(expected), "{found} should contain {expected}");
        }
        assert!(
            message("joint_position_rad_1,joint_torque_nm_1\n1,2\n1,2\n", None)
                .contains("--sample-rate")
        );
        assert!(message(&format!("{HEADER}0,1,2\n0.1,1,2\n"), Some(20.0)).contains("10.0"));
    }

    fn of_others(names: &[&str], scale: f64) -> AxisColumns {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        AxisColumns { names, scales: vec![scale, -scale] }
    }

    #[test]
    fn columns_of_others_are_read_by_name_unit_and_sign() {
        let columns = Columns {
            side: Side::Joint,
            axes: 2,
            time: Some(("t".into(), 1e-3)),
            position: of_others(&["actual_q_{index}"], 0.5),
            torque: of_others(&["tau_{axis}"], 1.0),
            reference: Some(of_others(&["goal", "aim"], 1.0)),
        };
        let read = |text: &str| whole(text.as_bytes(), None, Some(&columns));
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
            missing.contains(
                "column `tau_2` is missing or appears twice; the header has t actual_q_1"
            ),
            "{missing}"
        );
        assert!(said(&table.replace("mode", "tau_1")).contains("`tau_1`"));
        assert!(said(&table.replace("1,5", "x")).contains("line 3, column `actual_q_1`: `x`"));
    }
}
