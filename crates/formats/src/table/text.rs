//! Tables as text: a header and one row per line. Commas, semicolons or tabs separate the fields.
//! Unless commas separate them, numbers may have decimal commas.

use std::io::{BufRead, Chain, Cursor, Read};
use std::path::{Path, PathBuf};

use super::error::TableError;
use super::header::Column;
use super::place::RowPlace;
use super::source::{Source, TableValues};
use super::time::{ExactTime, FirstTime, digit_resolution, names_its_clock};
use crate::capacity::Capacity;

/// Largest length of a header line \[bytes\].
const LONGEST_HEADER: u64 = 1 << 20;

/// The beginning, which was read to find the separator, followed by the rest.
type Input = Chain<Cursor<Vec<u8>>, Box<dyn BufRead>>;

/// A text table whose header has been read.
pub(super) struct TextTable {
    path: PathBuf,
    reader: csv::Reader<Input>,
    names: Vec<String>,
    delimiter: u8,
}

impl TextTable {
    /// Reads the header. `wanted` are the columns looked for; they identify the separator.
    pub(super) fn open(
        mut input: Box<dyn BufRead>,
        path: &Path,
        wanted: &[String],
    ) -> Result<Self, TableError> {
        let path = path.to_path_buf();
        let mut begin = Vec::new();
        let read = (&mut input).take(LONGEST_HEADER).read_until(b'\n', &mut begin);
        read.map_err(|source| TableError::Io { file: path.clone(), source })?;
        let delimiter = find_separator(&begin, wanted);
        let input = Cursor::new(begin).chain(input);
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).delimiter(delimiter).from_reader(input);
        let header = reader.headers();
        let header = header.map_err(|error| TableError::Table { file: path.clone(), error })?;
        let names = header.iter().map(str::to_owned).collect();
        Ok(Self { path, reader, names, delimiter })
    }
}

impl Source for TextTable {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn seconds_per_unit(&self, _: usize) -> Option<f64> {
        None
    }

    fn first_row(&self) -> RowPlace {
        RowPlace::Line(2)
    }

    fn read(
        mut self: Box<Self>,
        columns: &[Column],
        capacity: Capacity,
    ) -> Result<TableValues, TableError> {
        let file = || self.path.clone();
        let mut values = vec![Vec::new(); columns.len()];
        let (mut first, mut finest) = (FirstTime::default(), f64::INFINITY);
        let mut of_no_clock = false;
        let mut record = csv::StringRecord::new();
        let mut rows = 0;
        while self
            .reader
            .read_record(&mut record)
            .map_err(|error| TableError::Table { file: file(), error })?
        {
            if rows == capacity.samples {
                return Err(TableError::TooLong { file: file(), samples: rows });
            }
            rows += 1;
            for (index, (column, text)) in columns.iter().zip(record.iter()).enumerate() {
                if *column == Column::Other {
                    continue;
                }
                let point =
                    (self.delimiter != b',' && text.contains(',')).then(|| text.replace(',', "."));
                let number = point.as_deref().unwrap_or(text);
                if number.is_empty() || number.parse().is_ok_and(f64::is_nan) {
                    values[index].push(f64::NAN);
                    continue;
                }
                let value = match column {
                    Column::Time => {
                        ExactTime::of_number(number).map(|time| first.seconds_after(time))
                    }
                    Column::Date => {
                        ExactTime::of_date(number).map(|time| first.seconds_after(time))
                    }
                    _ => number.parse().ok(),
                };
                let value = value.filter(|value| value.is_finite()).ok_or_else(|| {
                    let line = record.position().map_or(0, csv::Position::line);
                    let (file, place) = (file(), RowPlace::Line(line));
                    let (column_name, text) = (self.names[index].clone(), text.to_owned());
                    field_error(*column, file, place, column_name, text)
                })?;
                values[index].push(value);
                if column.is_time() {
                    finest = finest.min(digit_resolution(number));
                    of_no_clock |= *column == Column::Date && !names_its_clock(number);
                }
            }
        }
        let first = first.0.filter(|_| !of_no_clock);
        Ok(TableValues { columns: values, resolution: finest, first_time: first })
    }
}

/// Returns the error for a field.
fn field_error(
    of: Column,
    file: PathBuf,
    place: RowPlace,
    column: String,
    text: String,
) -> TableError {
    match of {
        Column::Date => TableError::NotADate { file, place, column, text },
        Column::Time if ExactTime::of_date(&text).is_some() => {
            TableError::Date { file, place, column, text }
        }
        _ => TableError::NotANumber { file, place, column, text },
    }
}

/// Returns the separator of a header line: the one that finds most of the wanted columns, or most
/// fields.
fn find_separator(line: &[u8], wanted: &[String]) -> u8 {
    let fields = |separator: u8| -> (usize, usize) {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .delimiter(separator)
            .from_reader(line);
        let Some(Ok(record)) = reader.records().next() else { return (0, 0) };
        let matching = record.iter().filter(|field| wanted.iter().any(|name| name == field));
        (matching.count(), record.len())
    };
    // If several separators are equally good, the comma wins.
    [b'\t', b';', b','].into_iter().max_by_key(|separator| fields(*separator)).unwrap_or(b',')
}
