//! `time` of `[data]`: the columns of a table that contain the time, their unit, and the resulting
//! rate.

use std::path::Path;

use didim_formats::{Columns, TableError, TableNames, TimeColumns, mean_rate_hz, read_rows};

use super::draft::Draft;
use super::evidence::ProposalError;
use super::limits::ProposalLimits;
use super::names::{ColumnMeaning, column_meaning, stamp_pairs, unit};
use super::plausible::round_rate;
use super::value::{Guess, quote_text};
use crate::cell::DATE_UNIT;

const UNIT_WORDS: &[(&str, &str)] =
    &[("s", "s"), ("sec", "s"), ("ms", "ms"), ("us", "us"), ("µs", "us"), ("ns", "ns")];
const UNIT_SECONDS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

/// The time of a table.
pub(super) struct TableTime {
    time_source: TimeSource,
    /// Sample rate that results from the unit \[Hz\].
    pub(super) rate_hz: Option<f64>,
    /// True if the unit is known from an answer, from the name or from the values.
    pub(super) is_stated: bool,
}

enum TimeSource {
    Column {
        name: String,
        unit: Option<&'static str>,
    },
    /// Columns of the whole seconds and of the remaining nanoseconds.
    Stamp([String; 2]),
    /// Columns that may contain the time, by their names.
    OneOf(Vec<String>),
}

impl TableTime {
    /// Finds the time of a table by detection or from an answer. If several columns are possible, a
    /// question is added.
    pub(super) fn find_time(
        draft: &Draft<'_>,
        file: &Path,
        names: &TableNames,
    ) -> Result<Option<Self>, ProposalError> {
        let answered = |key: &str| draft.answered_text(&format!("data.time.{key}"));
        match (names.own_format, answered("column"), answered("sec").zip(answered("nanosec"))) {
            (Some((_, true)), ..) => return of_column(draft, file, names, "time_s"),
            (Some((_, false)), ..) => return Ok(None),
            (None, Some(column), _) => return of_column(draft, file, names, &column),
            (None, None, Some((sec, nanosec))) => return of_stamp(file, [sec, nanosec]),
            (None, None, None) => {}
        }
        let pairs = stamp_pairs(&names.columns);
        // The stamps of messages belong to their signals. The times of a log do not.
        if let [[sec, nanosec]] = pairs.as_slice()
            && let Some(time) = of_stamp(file, [(*sec).clone(), (*nanosec).clone()])?
        {
            return Ok(Some(time));
        }
        let is_part = |name: &String| pairs.iter().flatten().any(|part| *part == name);
        let is =
            |name: &&String| column_meaning(name) == Some(ColumnMeaning::Time) && !is_part(name);
        let columns = names.columns.iter().filter(is);
        match (columns.clone().collect::<Vec<_>>().as_slice(), pairs.len()) {
            ([], 0 | 1) => Ok(None),
            ([one], 0 | 1) => of_column(draft, file, names, one),
            _ => {
                let pairs = pairs.iter().map(|[sec, nanosec]| format!("`{sec}` with `{nanosec}`"));
                let others = columns.map(|name| format!("`{name}`")).chain(pairs).collect();
                let which = TimeSource::OneOf(others);
                Ok(Some(Self { time_source: which, rate_hz: None, is_stated: false }))
            }
        }
    }

    /// Adds the entries for the keys of the time.
    pub(super) fn add_entries(&self, draft: &mut Draft<'_>, section: &str) {
        let Self { time_source: which, rate_hz, is_stated } = self;
        let guess = if *is_stated { Guess::from_file } else { Guess::assumed };
        let rows = |rate_hz: f64| format!("gives {rate_hz:.6} rows per second");
        match which {
            TimeSource::Stamp(columns) => {
                for (key, name) in ["time.sec", "time.nanosec"].into_iter().zip(columns) {
                    let why = "by its name, one of two parts of a stamp";
                    draft.add_entry(section, key, Guess::from_file(quote_text(name), why));
                }
            }
            TimeSource::Column { name, unit } => {
                draft.add_entry(
                    section,
                    "time.column",
                    Guess::from_file(quote_text(name), "by its name"),
                );
                let unit = match unit.zip(*rate_hz) {
                    Some((unit, rate_hz)) => guess(quote_text(unit), &rows(rate_hz)),
                    None => Guess::without_value(UNIT_QUESTION),
                };
                draft.add_entry(section, "time.unit", unit);
            }
            TimeSource::OneOf(columns) => {
                let columns = columns.join(" ");
                let question = format!(
                    "the column of the time, one of {columns}; two as `sec` and `nanosec`, without \
                    `unit`"
                );
                draft.add_entry(section, "time.column", Guess::without_value(&question));
                draft.add_entry(section, "time.unit", Guess::without_value(UNIT_QUESTION));
            }
        }
    }
}

const UNIT_QUESTION: &str = "the unit of the time: \"s\", \"ms\", \"us\" or \"ns\"";

/// Reads the times relative to the first one, and their rate. Times that go back are an error.
/// `None` if the column has no time.
fn read_advancing(
    file: &Path,
    name: &str,
    columns: TimeColumns,
) -> Result<Option<(Vec<f64>, f64)>, ProposalError> {
    let times = match read_rows(file, Some(&Columns::of_time(columns))) {
        Ok(table) => table.time.unwrap_or_default(),
        Err(
            TableError::NotANumber { .. }
            | TableError::Date { .. }
            | TableError::NotADate { .. }
            | TableError::NotFractional { .. }
            | TableError::NoNumbers { .. }
            | TableError::NoValues { .. },
        ) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    if let Some(row) = times.windows(2).position(|pair| pair[1] < pair[0]) {
        let (file, column, row) = (file.to_path_buf(), name.to_owned(), row + 2);
        return Err(ProposalError::Backwards { file, column, row });
    }
    let rate_hz = mean_rate_hz(&times);
    Ok(rate_hz.map(|rate_hz| (times, rate_hz)))
}

fn of_stamp(file: &Path, [sec, nanosec]: [String; 2]) -> Result<Option<TableTime>, ProposalError> {
    let columns = TimeColumns::Parts { sec: sec.clone(), nanosec: nanosec.clone() };
    let stamp = read_advancing(file, &sec, columns)?;
    Ok(stamp.map(|(_, rate_hz)| {
        let which = TimeSource::Stamp([sec, nanosec]);
        TableTime { time_source: which, rate_hz: Some(round_rate(rate_hz)), is_stated: true }
    }))
}

fn of_column(
    draft: &Draft<'_>,
    file: &Path,
    names: &TableNames,
    name: &str,
) -> Result<Option<TableTime>, ProposalError> {
    let column = name.to_owned();
    let mut types = names.columns.iter().zip(&names.seconds_per_unit);
    let by_type = types.find(|(own, _)| *own == name).and_then(|(_, second)| *second);
    let second = by_type.unwrap_or(1.0);
    let numbers = TimeColumns::Numbers { column: column.clone(), second };
    let Some((times, rate_hz)) = read_advancing(file, name, numbers)? else {
        let dates = read_advancing(file, name, TimeColumns::Dates { column: column.clone() })?;
        return Ok(dates.map(|(_, rate_hz)| {
            let which = TimeSource::Column { name: column, unit: Some(DATE_UNIT) };
            TableTime { time_source: which, rate_hz: Some(round_rate(rate_hz)), is_stated: true }
        }));
    };
    // The type of the column includes a unit, so the times are in seconds already.
    let rate_of = |unit: f64| rate_hz * second / unit;
    let by_type = UNIT_SECONDS.into_iter().find(|(_, second)| by_type == Some(*second));
    let by_type = by_type.map(|(unit, _)| Ok(unit.to_owned()));
    let unit_found = draft.answered_text("data.time.unit").map(Ok).or(by_type);
    let unit_found = unit_found.or_else(|| Some(unit(name, UNIT_WORDS)?.map(str::to_owned)));
    let is_stated = matches!(unit_found, Some(Ok(_)));
    let counts = times.windows(2).all(|pair| (pair[1] - pair[0] - 1.0).abs() < f64::EPSILON);
    let fits = match unit_found {
        Some(Ok(configured)) => UNIT_SECONDS.into_iter().find(|(unit, _)| *unit == configured),
        Some(Err(_)) => None,
        // The unit is ambiguous between a slow log in seconds and a fast log in milliseconds. A row
        // number is not a time.
        None if counts || (1.0..ProposalLimits::DEFAULT.rates_hz.start).contains(&rate_of(1.0)) => {
            None
        }
        None => UNIT_SECONDS
            .into_iter()
            .find(|(_, second)| ProposalLimits::DEFAULT.rates_hz.contains(&rate_of(*second))),
    };
    let (unit, rate_hz) = fits.map(|(unit, second)| (unit, round_rate(rate_of(second)))).unzip();
    Ok(Some(TableTime {
        time_source: TimeSource::Column { name: column, unit },
        rate_hz,
        is_stated,
    }))
}
