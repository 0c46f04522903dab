//! A long table as text.

use core::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::column::{LongColumn, LongValues};
use super::error::LongTableError;
use super::wanted::RequestedColumns;

/// A table that is being written as text.
pub(super) struct TextTable<'o> {
    writer: csv::Writer<&'o mut (dyn Write + Send)>,
    has_header: bool,
}

impl<'o> TextTable<'o> {
    pub(super) fn new(output: &'o mut (dyn Write + Send)) -> Self {
        Self { writer: csv::Writer::from_writer(output), has_header: false }
    }

    pub(super) fn write(&mut self, columns: &[LongColumn<'_>]) -> io::Result<()> {
        if !std::mem::replace(&mut self.has_header, true) {
            self.writer.write_record(columns.iter().map(|column| column.name))?;
        }
        let rows = columns.iter().map(|column| column.values.len()).max().unwrap_or(0);
        for row in 0..rows {
            let fields = columns.iter().map(|column| field_text(&column.values, row));
            self.writer.write_record(fields)?;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Formats a field. Numbers have enough digits to read the same value back.
fn field_text(values: &LongValues<'_>, row: usize) -> String {
    fn cell_text<T: Copy>(values: &[Option<T>], row: usize, show: impl Fn(T) -> String) -> String {
        values.get(row).copied().flatten().map_or(String::new(), show)
    }
    match values {
        LongValues::Text(values) => cell_text(values, row, str::to_owned),
        LongValues::Number(values) => cell_text(values, row, |value| match value.is_finite() {
            true => value.to_string(),
            false => String::new(),
        }),
        LongValues::Count(values) => cell_text(values, row, |count| count.to_string()),
        LongValues::Flag(values) => cell_text(values, row, |is| is.to_string()),
        LongValues::Time(values) => {
            cell_text(values, row, |seconds| instant_text(Duration::from_secs(seconds)))
        }
    }
}

/// Formats an instant, given as the time since 1970-01-01T00:00:00Z, to the second (RFC 3339).
/// Empty after the year 9999, which RFC 3339 cannot represent.
pub(super) fn instant_text(since: Duration) -> String {
    let mut text = String::new();
    let time = UNIX_EPOCH.checked_add(since).map(humantime::format_rfc3339_seconds);
    let is_written = time.is_some_and(|time| write!(text, "{time}").is_ok());
    if is_written { text } else { String::new() }
}

pub(super) fn read<const N: usize>(
    path: &Path,
    wanted: &mut RequestedColumns<'_, N>,
) -> Result<(), LongTableError> {
    let damaged = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(source) => LongTableError::Io(source),
        other => LongTableError::Damaged(format!("{other:?}")),
    };
    let mut reader = csv::Reader::from_path(path).map_err(damaged)?;
    let header = reader.headers().map_err(damaged)?;
    wanted.find(&header.iter().collect::<Vec<_>>())?;
    for row in reader.records() {
        wanted.take_row(row.map_err(damaged)?.iter().map(str::to_owned).collect());
    }
    Ok(())
}

#[cfg(test)]
#[test]
fn instants_have_four_digits_for_the_year() {
    let text_of = |seconds| instant_text(Duration::from_secs(seconds));
    assert_eq!(text_of(1_795_331_849), "2026-11-22T07:17:29Z");
    assert_eq!(text_of(253_402_300_799), "9999-12-31T23:59:59Z");
    assert_eq!([text_of(253_402_300_800), text_of(u64::MAX)], [""; 2]);
}
