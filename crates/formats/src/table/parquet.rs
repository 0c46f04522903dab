//! Parquet files: the names of their columns, and the numbers of requested columns, row group by
//! row group.

use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::column::Column;
use super::error::TableError;
use super::place::RowPlace;
use super::source::{Source, TableValues};
use super::time::{ExactTime, FirstTime, digit_resolution};
use crate::capacity::Capacity;
use crate::guarded::catch_panic as guard;

/// Number of values that are decoded at once.
const BATCH_VALUES: usize = 1 << 13;

/// Content of a column, by its type.
enum ColumnType {
    /// Numbers: index of the leaf column, and true if they are unsigned.
    Numbers { leaf: usize, unsigned: bool },
    /// An element of lists of numbers: index of the leaf column, the element, and the length.
    Element { leaf: usize, element: usize, length: usize },
    /// Times: index of the leaf column, seconds per unit, and true if they are in UTC.
    Times { leaf: usize, second: f64, utc: bool },
    /// Another type, with its name.
    Other(&'static str),
}

/// A Parquet file whose footer has been read.
pub(super) struct ParquetTable {
    path: PathBuf,
    reader: SerializedFileReader<File>,
    names: Vec<String>,
    column_types: Vec<ColumnType>,
}

impl ParquetTable {
    /// Reads the footer.
    pub(super) fn open(file: File, path: &Path) -> Result<Self, TableError> {
        call_parquet(path, || {
            let damaged = |error: ParquetError| error_of(path, &error);
            let reader = SerializedFileReader::new(file).map_err(damaged)?;
            let schema = reader.metadata().file_metadata().schema_descr_ptr();
            let fields = schema.root_schema().get_fields();
            let mut leaves: Vec<Vec<usize>> = vec![Vec::new(); fields.len()];
            for leaf in 0..schema.num_columns() {
                leaves[schema.get_column_root_idx(leaf)].push(leaf);
            }
            let (mut names, mut column_types) = (Vec::new(), Vec::new());
            for (field, leaves) in fields.iter().zip(leaves) {
                let types = match leaves.as_slice() {
                    [leaf] if field.is_primitive() => {
                        vec![(String::new(), of_type(*leaf, &schema.column(*leaf)))]
                    }
                    [leaf] => list_types(*leaf, &schema.column(*leaf), &reader).map_err(damaged)?,
                    _ => vec![(String::new(), ColumnType::Other("nested values"))],
                };
                for (index, column_type) in types {
                    names.push(format!("{}{index}", field.name()));
                    column_types.push(column_type);
                }
            }
            Ok(Self { path: path.to_path_buf(), reader, names, column_types })
        })
    }

    /// Reads the numbers of one column. For times it also returns the value of the last digit of
    /// the finest one.
    fn column(
        &self,
        index: usize,
        is_time: bool,
        most: usize,
    ) -> Result<ColumnNumbers, TableError> {
        let (leaf, unsigned, part) = match self.column_types[index] {
            ColumnType::Numbers { leaf, unsigned } => (leaf, unsigned, None),
            ColumnType::Times { leaf, .. } => (leaf, false, None),
            ColumnType::Element { leaf, element, length } => (leaf, false, Some((element, length))),
            ColumnType::Other(what) => {
                let (file, column) = (self.path.clone(), self.names[index].clone());
                return Err(TableError::NoNumbers { file, column, what });
            }
        };
        let damaged = |error: ParquetError| error_of(&self.path, &error);
        let mut numbers = ColumnNumbers {
            values: Vec::new(),
            expected_count: most,
            part,
            first_time: is_time.then(FirstTime::default),
            finest_resolution: f64::INFINITY,
        };
        let mut rows = 0;
        for group in 0..self.reader.num_row_groups() {
            let group = self.reader.get_row_group(group).map_err(damaged)?;
            // The library would panic on these and print to standard error.
            let chunk = group.metadata().column(leaf);
            let first = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
            if first < 0 || chunk.compressed_size() < 0 {
                let problem = "a column begins or ends before the file".to_owned();
                return Err(TableError::Parquet { file: self.path.clone(), what: problem });
            }
            rows += usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
            #[expect(clippy::cast_precision_loss, reason = "numbers of tables are below 2^53")]
            #[expect(clippy::cast_sign_loss, reason = "what an unsigned type means by these bits")]
            let read = match group.get_column_reader(leaf).map_err(damaged)? {
                ColumnReader::DoubleColumnReader(from) => numbers.read(from, |value| (value, None)),
                ColumnReader::FloatColumnReader(from) => {
                    numbers.read(from, |value| (value.into(), None))
                }
                ColumnReader::Int32ColumnReader(from) if unsigned => {
                    numbers.read(from, |value| (f64::from(value as u32), None))
                }
                ColumnReader::Int32ColumnReader(from) => {
                    numbers.read(from, |value| (value.into(), None))
                }
                ColumnReader::Int64ColumnReader(from) if unsigned => {
                    numbers.read(from, |value| (value as u64 as f64, None))
                }
                ColumnReader::Int64ColumnReader(from) => {
                    numbers.read(from, |value| (value as f64, Some(value)))
                }
                _ => Err(ReadingEnd::Damaged(
                    "a column has another type than the header says".into(),
                )),
            };
            read.map_err(|stop| match stop {
                ReadingEnd::NotANumber(text) => TableError::NotANumber {
                    file: self.path.clone(),
                    place: self.first_row().rows_later(numbers.values.len()),
                    column: self.names[index].clone(),
                    text,
                },
                ReadingEnd::Damaged(what) => TableError::Parquet { file: self.path.clone(), what },
            })?;
            if numbers.values.len() != rows {
                let problem = format!("{} of {rows} rows are there", numbers.values.len());
                return Err(TableError::Parquet { file: self.path.clone(), what: problem });
            }
        }
        Ok(numbers)
    }
}

impl Source for ParquetTable {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn seconds_per_unit(&self, column: usize) -> Option<f64> {
        match self.column_types.get(column) {
            Some(ColumnType::Times { second, .. }) => Some(*second),
            _ => None,
        }
    }

    fn has_text(&self, column: usize) -> bool {
        matches!(self.column_types.get(column), Some(ColumnType::Other(_)))
    }

    fn first_row(&self) -> RowPlace {
        RowPlace::Row(1)
    }

    fn read(
        self: Box<Self>,
        columns: &[Column],
        capacity: Capacity,
    ) -> Result<TableValues, TableError> {
        let groups = self.reader.metadata().row_groups().iter();
        let rows = groups.map(|group| usize::try_from(group.num_rows()).unwrap_or(usize::MAX));
        let rows = rows.fold(0, usize::saturating_add);
        if rows > capacity.samples {
            return Err(TableError::TooLong { file: self.path.clone(), samples: capacity.samples });
        }
        let mut values = TableValues { resolution: 0.0, ..TableValues::new(columns.len()) };
        for (index, column) in columns.iter().enumerate() {
            if *column == Column::Other {
                continue;
            }
            let is_time = *column == Column::Time;
            let numbers = call_parquet(&self.path, || self.column(index, is_time, rows))?;
            values.columns[index] = numbers.values;
            if is_time {
                values.resolution = numbers.finest_resolution;
                let is_local =
                    matches!(self.column_types[index], ColumnType::Times { utc: false, .. });
                values.first_time =
                    numbers.first_time.and_then(|first| first.0).filter(|_| !is_local);
            }
        }
        Ok(values)
    }
}

/// Returns a column for each element of lists of numbers, with its index. The first list shows the
/// length of all.
fn list_types(
    leaf: usize,
    column: &ColumnDescriptor,
    reader: &SerializedFileReader<File>,
) -> Result<Vec<(String, ColumnType)>, ParquetError> {
    use parquet::basic::Type;
    let is_list = column.max_rep_level() == 1;
    let is_number = matches!(column.physical_type(), Type::DOUBLE | Type::FLOAT);
    let nested = || vec![(String::new(), ColumnType::Other("nested values"))];
    if !is_list || !is_number || reader.num_row_groups() == 0 {
        return Ok(nested());
    }
    let length = match reader.get_row_group(0)?.get_column_reader(leaf)? {
        ColumnReader::DoubleColumnReader(from) => first_length(from)?,
        ColumnReader::FloatColumnReader(from) => first_length(from)?,
        _ => 0,
    };
    let element = |element| ColumnType::Element { leaf, element, length };
    let types: Vec<_> = (0..length).map(|at| (format!("[{at}]"), element(at))).collect();
    Ok(if types.is_empty() { nested() } else { types })
}

/// Returns the length of the first list.
fn first_length<T: DataType>(mut from: ColumnReaderImpl<T>) -> Result<usize, ParquetError> {
    let (mut values, mut levels, mut repetitions) = (Vec::new(), Vec::new(), Vec::new());
    from.read_records(1, Some(&mut levels), Some(&mut repetitions), &mut values)?;
    Ok(values.len())
}

fn of_type(leaf: usize, column: &ColumnDescriptor) -> ColumnType {
    use parquet::basic::Type;
    if column.max_rep_level() > 0 {
        return ColumnType::Other("lists");
    }
    let second = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e-3,
        TimeUnit::MICROS => 1e-6,
        TimeUnit::NANOS => 1e-9,
    };
    match (column.physical_type(), column.logical_type_ref(), column.converted_type()) {
        (Type::INT64, Some(LogicalType::Timestamp(of)), _) => {
            ColumnType::Times { leaf, second: second(&of.unit), utc: of.is_adjusted_to_u_t_c }
        }
        (Type::INT32 | Type::INT64, Some(LogicalType::Time(of)), _) => {
            ColumnType::Times { leaf, second: second(&of.unit), utc: of.is_adjusted_to_u_t_c }
        }
        // Files of formats before 2.4 use this type.
        (_, None, ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS) => {
            ColumnType::Times { leaf, second: 1e-3, utc: true }
        }
        (_, None, ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS) => {
            ColumnType::Times { leaf, second: 1e-6, utc: true }
        }
        (_, Some(LogicalType::Date), _) | (_, _, ConvertedType::DATE) => ColumnType::Other("dates"),
        (_, Some(LogicalType::Decimal(_)), _) | (_, _, ConvertedType::DECIMAL) => {
            ColumnType::Other("decimals of a fixed scale")
        }
        (Type::DOUBLE | Type::FLOAT, ..) => ColumnType::Numbers { leaf, unsigned: false },
        (Type::INT32 | Type::INT64, _, converted) => {
            use ConvertedType::{UINT_8, UINT_16, UINT_32, UINT_64};
            let unsigned = matches!(converted, UINT_8 | UINT_16 | UINT_32 | UINT_64);
            ColumnType::Numbers { leaf, unsigned }
        }
        (Type::BOOLEAN, ..) => ColumnType::Other("what is true or false"),
        (Type::INT96, ..) => ColumnType::Other("times of the outdated type INT96"),
        (_, Some(LogicalType::Float16), _) => ColumnType::Other("numbers of half precision"),
        (Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY, ..) => ColumnType::Other("text or bytes"),
    }
}

/// Reason why reading the numbers of a column ends.
enum ReadingEnd {
    /// A value that is not a number, as text.
    NotANumber(String),
    Damaged(String),
}

impl From<ParquetError> for ReadingEnd {
    fn from(error: ParquetError) -> Self {
        Self::Damaged(error.to_string())
    }
}

/// The numbers of a column so far.
struct ColumnNumbers {
    values: Vec<f64>,
    /// Number of values according to the footer.
    expected_count: usize,
    /// Element of a list, and the length of the lists.
    part: Option<(usize, usize)>,
    /// First time, from which times are counted.
    first_time: Option<FirstTime>,
    finest_resolution: f64,
}

impl ColumnNumbers {
    /// Reads a column. `number` gives the value, and the exact integer if a double may not hold it.
    fn read<T: DataType>(
        &mut self,
        mut from: ColumnReaderImpl<T>,
        number: impl Fn(T::T) -> (f64, Option<i64>),
    ) -> Result<(), ReadingEnd> {
        let (mut read, mut levels): (Vec<T::T>, Vec<i16>) = (Vec::new(), Vec::new());
        let mut repetitions: Vec<i16> = Vec::new();
        loop {
            read.clear();
            levels.clear();
            if let Some((element, length)) = self.part {
                repetitions.clear();
                let (rows, ..) = from.read_records(
                    BATCH_VALUES,
                    Some(&mut levels),
                    Some(&mut repetitions),
                    &mut read,
                )?;
                if rows == 0 {
                    return Ok(());
                }
                if read.len() != rows * length || repetitions.len() != rows * length {
                    let problem = format!("lists of another length than {length}, or with nulls");
                    return Err(ReadingEnd::Damaged(problem));
                }
                let parts = read.drain(..).skip(element).step_by(length);
                self.values.extend(parts.map(|value| number(value).0));
                continue;
            }
            // Levels mark nulls. They are only filled if the column may have nulls.
            let (rows, ..) = from.read_records(BATCH_VALUES, Some(&mut levels), None, &mut read)?;
            if rows == 0 {
                return Ok(());
            }
            let lacks = read.len() < rows;
            let mut values = read.drain(..);
            for row in 0..rows {
                if lacks && levels.get(row) == Some(&0) {
                    self.values.push(f64::NAN);
                    continue;
                }
                let Some(value) = values.next() else {
                    return Err(ReadingEnd::Damaged("fewer values than rows".to_owned()));
                };
                let text = self.first_time.is_some().then(|| value.to_string());
                let (mut value, complete) = number(value);
                if value.is_nan() {
                    self.values.push(value);
                    continue;
                }
                if value.is_infinite() {
                    return Err(ReadingEnd::NotANumber(value.to_string()));
                }
                if let (Some(first), Some(text)) = (&mut self.first_time, text) {
                    self.finest_resolution = self.finest_resolution.min(digit_resolution(&text));
                    let integer = complete.map(|complete_rows| ExactTime {
                        whole_part: complete_rows,
                        fraction: 0.0,
                    });
                    value = first.seconds_after(integer.unwrap_or(value.into()));
                }
                self.values.push(value);
            }
            if self.values.len() > self.expected_count {
                return Err(ReadingEnd::Damaged("more rows than the footer says".to_owned()));
            }
        }
    }
}

fn error_of(path: &Path, error: &ParquetError) -> TableError {
    TableError::Parquet { file: path.to_path_buf(), what: error.to_string() }
}

/// Calls the library, which may panic.
fn call_parquet<T>(
    path: &Path,
    call: impl FnOnce() -> Result<T, TableError>,
) -> Result<T, TableError> {
    guard(call, |what| TableError::Parquet { file: path.to_path_buf(), what })
}
