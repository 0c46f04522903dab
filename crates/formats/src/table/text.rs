//! Tables as text: one row per line, below a header or without one. Commas, semicolons, tabs or
//! blanks separate the fields. Numbers may have decimal commas.

use std::io::{BufRead, Chain, Cursor, Read};
use std::path::{Path, PathBuf};

use super::column::Column;
use super::error::TableError;
use super::lines::{LONGEST_LINE, LimitedLines};
use super::list::elements;
use super::place::RowPlace;
use super::source::{Source, TableValues};
use super::text_layout::{
    INSPECTED_RECORDS, TextLayout, is_comment, reader_builder, with_decimal_point,
};
use super::time::{ExactTime, FirstTime, digit_resolution, names_its_clock};
use crate::capacity::Capacity;

/// The beginning, which was read to find the layout, followed by the rest.
type Input = Chain<Cursor<Vec<u8>>, LimitedLines>;

/// A text table whose header has been read.
pub(super) struct TextTable {
    path: PathBuf,
    reader: csv::Reader<Input>,
    layout: TextLayout,
}

impl TextTable {
    /// Reads the header. `wanted` are the columns looked for; they identify separator and header.
    pub(super) fn open(
        input: Box<dyn BufRead>,
        path: &Path,
        wanted: &[String],
    ) -> Result<Self, TableError> {
        let path = path.to_path_buf();
        let mut input = LimitedLines::new(input);
        let mut begin = Vec::new();
        for _ in 0..INSPECTED_RECORDS {
            let read = input.read_until(b'\n', &mut begin);
            if read.map_err(|error| TableError::from_io(&path, error))? == 0
                || begin.len() > LONGEST_LINE
            {
                break;
            }
        }
        input.begin_record();
        let layout = TextLayout::find(&begin, wanted);
        // Fields are trimmed as they are read, which copies no record.
        let mut builder = reader_builder(layout.separator);
        let reader = builder.trim(csv::Trim::None).from_reader(Cursor::new(begin).chain(input));
        Ok(Self { path, reader, layout })
    }

    /// Reads the next row into `record`; false at the end. Comments are skipped.
    fn next_row(&mut self, record: &mut csv::StringRecord) -> Result<bool, TableError> {
        // The lines before the rows may have another encoding.
        let mut before_rows = csv::ByteRecord::new();
        for _ in 0..core::mem::take(&mut self.layout.records_before) {
            let read = self.reader.read_byte_record(&mut before_rows);
            if !read.map_err(|error| TableError::from_csv(&self.path, error))? {
                return Ok(false);
            }
        }
        loop {
            self.reader.get_mut().get_mut().1.begin_record();
            let line = self.reader.position().line();
            let read = self.reader.read_record(record);
            let read = read.map_err(|error| TableError::from_csv(&self.path, error));
            // The limit of a record is reached many lines after its beginning.
            if !read.map_err(|error| error.of_record(line))? {
                return Ok(false);
            }
            if !record.get(0).is_some_and(|field| is_comment(field.trim())) {
                return Ok(true);
            }
        }
    }

    /// Checks the number of fields. Empty fields at the end do not count.
    fn check_length(&self, record: &csv::StringRecord, fields: usize) -> Result<(), TableError> {
        let expected = self.layout.field_count;
        let surplus_empty = record.iter().skip(expected).all(|field| field.trim().is_empty());
        let header = self.layout.head.first().map_or(&[][..], Vec::as_slice);
        let missing_empty = header.iter().skip(fields).all(String::is_empty);
        if fields == expected || (fields > expected && surplus_empty) {
            return Ok(());
        }
        if fields < expected && !header.is_empty() && missing_empty {
            return Ok(());
        }
        Err(TableError::FieldCount {
            file: self.path.clone(),
            line: record.position().map_or(0, csv::Position::line),
            found: fields,
            expected,
            header_line: self.layout.header_line,
        })
    }

    /// Returns a field without the unit that follows each number of its column.
    fn without_unit<'a>(&self, index: usize, text: &'a str) -> &'a str {
        // A comparison with an empty text takes 60 ns on processors with AVX-512.
        let suffix = self.layout.suffixes.get(index).filter(|of| !of.is_empty());
        match suffix.and_then(|of| text.strip_suffix(of.as_str())) {
            Some(number) => number.trim_end(),
            None => text,
        }
    }

    /// Parses a field without its unit.
    fn number(column: Column, text: &str, first: &mut FirstTime) -> Option<f64> {
        let number = &*with_decimal_point(text);
        let value = number.parse().ok();
        if number.is_empty() || value.is_some_and(f64::is_nan) {
            return Some(f64::NAN);
        }
        let value = match column {
            Column::Time => ExactTime::of_number(number).map(|time| first.seconds_after(time)),
            Column::Date => ExactTime::of_date(number).map(|time| first.seconds_after(time)),
            _ => value,
        };
        value.filter(|value| value.is_finite())
    }
}

impl Source for TextTable {
    fn names(&self) -> &[String] {
        &self.layout.names
    }

    fn units(&self) -> &[String] {
        &self.layout.units
    }

    fn first_row_texts(&self) -> &[String] {
        &self.layout.first_row
    }

    fn find_texts(&mut self) {
        let (begin, _) = self.reader.get_ref().get_ref();
        self.layout.find_texts(begin.get_ref());
    }

    fn has_text(&self, column: usize) -> bool {
        let field = self.layout.columns.get(column).map(|of| of.field);
        field.and_then(|field| self.layout.is_text.get(field)).copied().unwrap_or(false)
    }

    fn has_header(&self) -> bool {
        self.layout.header_line.is_some()
    }

    /// A duration of MATLAB is in seconds: `0.004 sec`.
    fn seconds_per_unit(&self, column: usize) -> Option<f64> {
        (self.layout.suffixes.get(column)? == "sec").then_some(1.0)
    }

    fn first_row(&self) -> RowPlace {
        RowPlace::Line(self.layout.first_line)
    }

    fn read(
        mut self: Box<Self>,
        columns: &[Column],
        capacity: Capacity,
    ) -> Result<TableValues, TableError> {
        let mut read = TableValues::new(columns.len());
        let (mut first, mut of_no_clock) = (FirstTime::default(), false);
        let mut record = csv::StringRecord::new();
        let mut rows = 0;
        while self.next_row(&mut record)? {
            let fields: Vec<&str> = match self.layout.separator {
                // Several blanks are one separator.
                b' ' => record.iter().map(str::trim).filter(|field| !field.is_empty()).collect(),
                _ => record.iter().map(str::trim).collect(),
            };
            if self.layout.head.iter().any(|head| *head == fields) {
                // Another recording was appended with its header.
                if read.begins.last() != Some(&rows) && rows > 0 {
                    read.begins.push(rows);
                }
                continue;
            }
            self.check_length(&record, fields.len())?;
            if rows == capacity.samples {
                return Err(TableError::TooLong { file: self.path.clone(), samples: rows });
            }
            rows += 1;
            let mut list: (usize, Option<Vec<&str>>) = (usize::MAX, None);
            for (index, column) in columns.iter().enumerate() {
                if *column == Column::Other {
                    continue;
                }
                let place = &self.layout.columns[index];
                let field = fields.get(place.field).copied().unwrap_or("");
                let text = match place.element {
                    None => field,
                    Some(element) => {
                        if list.0 != place.field {
                            list = (place.field, elements(field));
                        }
                        let part = list.1.as_ref().and_then(|parts| parts.get(element).copied());
                        part.unwrap_or(field)
                    }
                };
                let number = self.without_unit(index, text);
                let value = Self::number(*column, number, &mut first).ok_or_else(|| {
                    let line = record.position().map_or(0, csv::Position::line);
                    let (file, place) = (self.path.clone(), RowPlace::Line(line));
                    let (name, text) = (self.layout.names[index].clone(), text.to_owned());
                    field_error(*column, file, place, name, text)
                })?;
                read.columns[index].push(value);
                if column.is_time() && !value.is_nan() {
                    read.resolution = read.resolution.min(digit_resolution(number));
                    of_no_clock |= *column == Column::Date && !names_its_clock(text);
                }
            }
        }
        read.first_time = first.0.filter(|_| !of_no_clock);
        Ok(read)
    }
}

/// Largest number of characters of a field that an error shows.
const MAX_SHOWN: usize = 40;

/// Returns the error for a field.
fn field_error(
    of: Column,
    file: PathBuf,
    place: RowPlace,
    column: String,
    text: String,
) -> TableError {
    let date = ExactTime::of_date(&text);
    let text = match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    };
    match of {
        Column::Date => TableError::NotADate { file, place, column, text },
        Column::Time if date.is_some() => TableError::Date { file, place, column, text },
        _ => TableError::NotANumber { file, place, column, text },
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, repeat};

    use super::*;

    /// The rest of the file never ends, so a reader that keeps it would fill the memory.
    #[test]
    fn a_quote_without_its_end_is_refused_with_its_line() {
        let begin = "time_s,a\n0.0,1\n0.1,2\n0.2,\"3\n";
        // Lines that follow the quote, and one line that is itself too long.
        for (filler, line) in [(b'\n', 4), (b'0', 5)] {
            let file = Cursor::new(begin.as_bytes()).chain(BufReader::new(repeat(filler)));
            let wanted = ["time_s".to_owned(), "a".to_owned()];
            let columns = [Column::Time, Column::Other];
            let capacity = Capacity { samples: 1_000 };
            let table = TextTable::open(Box::new(file), Path::new("a.csv"), &wanted);
            let read = table.and_then(|table| Box::new(table).read(&columns, capacity));
            let error = read.err().unwrap();
            let found = match error {
                TableError::LongLine { line, .. } => line,
                other => panic!("{other:?}"),
            };
            assert_eq!(found, line);
        }
    }
}
