//! A long table as text.

use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::column::{LongColumn, LongValues};
use super::error::LongTableError;
use super::wanted::Wanted;

pub(super) fn write(columns: &[LongColumn<'_>], output: &mut dyn Write) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(output);
    writer.write_record(columns.iter().map(|column| column.name))?;
    let rows = columns.iter().map(|column| column.values.len()).max().unwrap_or(0);
    for row in 0..rows {
        writer.write_record(columns.iter().map(|column| field(&column.values, row)))?;
    }
    writer.flush()
}

/// Numbers have as many digits as it takes to read the same value back.
fn field(values: &LongValues<'_>, row: usize) -> String {
    fn of<T: Copy>(values: &[Option<T>], row: usize, show: impl Fn(T) -> String) -> String {
        values.get(row).copied().flatten().map_or(String::new(), show)
    }
    match values {
        LongValues::Text(values) => of(values, row, str::to_owned),
        LongValues::Number(values) => of(values, row, |value| match value.is_finite() {
            true => value.to_string(),
            false => String::new(),
        }),
        LongValues::Count(values) => of(values, row, |count| count.to_string()),
        LongValues::Flag(values) => of(values, row, |is| is.to_string()),
        LongValues::Time(values) => {
            of(values, row, |seconds| instant(Duration::from_secs(seconds)))
        }
    }
}

/// An instant so long after 1970-01-01T00:00:00Z, to the second, in the form of RFC 3339.
pub(super) fn instant(since: Duration) -> String {
    let time = UNIX_EPOCH.checked_add(since);
    time.map_or(String::new(), |time| humantime::format_rfc3339_seconds(time).to_string())
}

pub(super) fn read<const N: usize>(
    path: &Path,
    wanted: &mut Wanted<'_, N>,
) -> Result<(), LongTableError> {
    let damaged = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(source) => LongTableError::Io(source),
        other => LongTableError::Damaged(format!("{other:?}")),
    };
    let mut reader = csv::Reader::from_path(path).map_err(damaged)?;
    let header = reader.headers().map_err(damaged)?;
    wanted.find(&header.iter().collect::<Vec<_>>())?;
    for row in reader.records() {
        wanted.take(row.map_err(damaged)?.iter().map(str::to_owned).collect())?;
    }
    Ok(())
}
