//! `time` of `[data]`: the columns of a table that contain the time, their unit, and the resulting
//! rate.

use std::path::Path;

use didim_formats::{
    Columns, TableError, TableNames, TimeColumns, join_times, mean_rate_hz, read_rows,
};

use super::draft::Draft;
use super::evidence::ProposalError;
use super::limits::ProposalLimits;
use super::names::{
    ColumnMeaning, column_meaning, is_message_stamp, is_numbered, stamp_pairs, unit,
};
use super::plausible::round_rate;
use super::value::{Guess, quote_text};
use crate::cell::DATE_UNIT;
use crate::text::significant_digits;

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
    /// Number of rows in which each state stands, if more than one.
    pub(super) rows_per_state: Option<usize>,
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
    /// A column whose values are all the same.
    Constant(String),
}

/// The rows of a table whose time is looked for.
#[derive(Clone, Copy)]
pub(super) struct TableRows<'a> {
    pub(super) file: &'a Path,
    pub(super) names: &'a TableNames,
    /// Columns of the signals. Rows without them are those of other topics.
    pub(super) signals: Option<&'a Columns>,
}

impl TableTime {
    /// Finds the time of a table by detection or from an answer. If several columns are possible, a
    /// question is added.
    pub(super) fn find_time(
        draft: &Draft<'_>,
        rows: TableRows<'_>,
    ) -> Result<Option<Self>, ProposalError> {
        let names = rows.names;
        let answered = |key: &str| {
            let value = draft.answer(&format!("data.time.{key}"))?;
            value.as_str().map(str::to_owned).or_else(|| Some(value.as_integer()?.to_string()))
        };
        match (names.own_format, answered("column"), answered("sec").zip(answered("nanosec"))) {
            (Some((_, true)), ..) => return rows.time_of_column(draft, "time_s"),
            (Some((_, false)), ..) => return Ok(None),
            (None, Some(column), _) => return rows.time_of_column(draft, &column),
            (None, None, Some((sec, nanosec))) => return rows.time_of_stamp([sec, nanosec]),
            (None, None, None) => {}
        }
        let pairs = stamp_pairs(&names.columns);
        // The stamps of messages belong to their signals. The times of a log do not.
        if let [[sec, nanosec]] = pairs.as_slice()
            && let Some(time) = rows.time_of_stamp([(*sec).clone(), (*nanosec).clone()])?
        {
            return Ok(Some(time));
        }
        let is_part = |name: &String| pairs.iter().flatten().any(|part| *part == name);
        let is = |name: &&String| {
            column_meaning(name) == Some(ColumnMeaning::Time)
                && !is_part(name)
                && !is_numbered(&names.columns, name)
        };
        let columns = names.columns.iter().filter(is);
        let mut stamps = columns.clone().filter(|name| is_message_stamp(name));
        if let (Some(stamp), None) = (stamps.next(), stamps.next()) {
            return rows.time_of_column(draft, stamp);
        }
        match (columns.clone().collect::<Vec<_>>().as_slice(), pairs.len()) {
            ([], 0) => rows.time_without_name(draft),
            ([], 1) => Ok(None),
            ([one], 0 | 1) => rows.time_of_column(draft, one),
            _ => {
                let pairs = pairs.iter().map(|[sec, nanosec]| format!("`{sec}` with `{nanosec}`"));
                let others = columns.map(|name| format!("`{name}`")).chain(pairs).collect();
                let which = TimeSource::OneOf(others);
                let (rate_hz, is_stated, rows_per_state) = (None, false, None);
                Ok(Some(Self { time_source: which, rate_hz, is_stated, rows_per_state }))
            }
        }
    }

    /// Proposes the rate.
    pub(super) fn rate_guess(&self) -> Guess {
        let guess = if self.is_stated { Guess::from_file } else { Guess::assumed };
        match (self.rate_hz, self.rows_per_state, &self.time_source) {
            (Some(rate_hz), Some(rows), _) => {
                let why = format!(
                    "each state stands in {rows} rows: the log has {} rows a second, and the arm \
                    sent fewer states",
                    rate_text(rate_hz)
                );
                #[expect(clippy::cast_precision_loss, reason = "rows of a state")]
                Guess::assumed(rate_text(rate_hz / rows as f64), &why)
            }
            (Some(rate_hz), None, _) => guess(rate_text(rate_hz), "the mean distance of the times"),
            (None, _, TimeSource::Constant(name)) => Guess::without_value(&format!(
                "samples a second; the times of `{name}` are all the same, as when seconds after \
                1970 are written with 32 bits or few digits"
            )),
            (None, ..) => Guess::without_value("samples a second; the unit of the time tells it"),
        }
    }

    /// Adds the entries for the keys of the time.
    pub(super) fn add_entries(&self, draft: &mut Draft<'_>, section: &str) {
        let Self { time_source: which, rate_hz, is_stated, .. } = self;
        let guess = if *is_stated { Guess::from_file } else { Guess::assumed };
        let rows = |rate_hz: f64| {
            format!("gives {} rows per second", rate_text(rate_hz).trim_end_matches(".0"))
        };
        match which {
            TimeSource::Stamp(columns) => {
                for (key, name) in ["time.sec", "time.nanosec"].into_iter().zip(columns) {
                    let why = "by its name, one of two parts of a stamp";
                    draft.add_entry(section, key, Guess::from_file(column_text(name), why));
                }
            }
            TimeSource::Column { name, unit } => {
                let why = match name.parse::<u16>() {
                    Ok(_) => "the number of the column, from 1; its values advance steadily",
                    Err(_) => "by its name",
                };
                let column = Guess::from_file(column_text(name), why);
                draft.add_entry(section, "time.column", column);
                let unit = match unit.zip(*rate_hz) {
                    Some((unit, rate_hz)) => guess(quote_text(unit), &rows(rate_hz)),
                    None => Guess::without_value(UNIT_QUESTION),
                };
                draft.add_entry(section, "time.unit", unit);
            }
            TimeSource::Constant(_) => {}
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

/// Formats a rate as a TOML number: a rounded one as it is, another one with six digits, which is
/// finer than the tolerance of a table's times.
fn rate_text(rate_hz: f64) -> String {
    match rate_hz.fract() == 0.0 {
        true => format!("{rate_hz:?}"),
        false => {
            let digits = significant_digits(rate_hz, 6);
            digits.parse::<f64>().map_or(digits, |rate_hz| format!("{rate_hz:?}"))
        }
    }
}

/// Formats a column: its number as a number.
pub(super) fn column_text(name: &str) -> String {
    if name.parse::<u16>().is_ok() { name.to_owned() } else { quote_text(name) }
}

/// Times of a column.
struct ColumnTimes {
    times_s: Vec<f64>,
    /// `None` if all are the same.
    rate_hz: Option<f64>,
    rows_per_state: Option<usize>,
}

impl ColumnTimes {
    /// Returns true if the times advance by steps of one length, as no signal does.
    fn is_steady(&self) -> bool {
        let Some(rate_hz) = self.rate_hz else { return false };
        let steps = || self.times_s.windows(2).map(|pair| pair[1] - pair[0]);
        let steady = steps().filter(|step| (step * rate_hz - 1.0).abs() < 0.5).count();
        steps().all(|step| step >= 0.0) && 10 * steady > 9 * steps().count()
    }
}

impl TableRows<'_> {
    /// Reads the times relative to the first one, and their rate. Times that go back are an error.
    /// `None` if the column has no time.
    fn read_times(
        &self,
        name: &str,
        time: TimeColumns,
    ) -> Result<Option<ColumnTimes>, ProposalError> {
        let columns = match self.signals {
            Some(signals) => Columns { time: Some(time), ..signals.clone() },
            None => Columns::of_time(time),
        };
        let table = match read_rows(self.file, Some(&columns)) {
            Ok(table) => table,
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
        let rows_per_state = table.rows_per_state();
        let mut times_s = table.time.unwrap_or_default();
        if let Some(row) = join_times(&mut times_s) {
            let (file, column) = (self.file.to_path_buf(), name.to_owned());
            return Err(ProposalError::Backwards { file, column, row });
        }
        let rate_hz = mean_rate_hz(&times_s);
        Ok(Some(ColumnTimes { times_s, rate_hz, rows_per_state }))
    }

    /// Returns the time of columns that need no unit.
    fn time_without_unit(
        &self,
        name: &str,
        columns: TimeColumns,
        time_source: TimeSource,
    ) -> Result<Option<TableTime>, ProposalError> {
        let times = self.read_times(name, columns)?;
        Ok(times.and_then(|times| {
            let rate_hz = Some(round_rate(times.rate_hz?));
            let (is_stated, rows_per_state) = (true, times.rows_per_state);
            Some(TableTime { time_source, rate_hz, is_stated, rows_per_state })
        }))
    }

    fn time_of_stamp(
        &self,
        [sec, nanosec]: [String; 2],
    ) -> Result<Option<TableTime>, ProposalError> {
        let columns = TimeColumns::Parts { sec: sec.clone(), nanosec: nanosec.clone() };
        self.time_without_unit(&sec.clone(), columns, TimeSource::Stamp([sec, nanosec]))
    }

    /// Looks for a time that no name shows: a stamp in the first two columns, or steady numbers in
    /// the first one.
    fn time_without_name(&self, draft: &Draft<'_>) -> Result<Option<TableTime>, ProposalError> {
        let [first, second] = ["1", "2"].map(str::to_owned);
        let is_date =
            |text: &String| text.parse().is_ok_and(|seconds: u32| seconds > 1_000_000_000);
        let is_whole = |text: &String| text.parse::<u32>().is_ok();
        let mut texts = self.names.first_row.iter();
        if texts.next().is_some_and(is_date)
            && texts.next().is_some_and(is_whole)
            && let Some(time) = self.time_of_stamp([first.clone(), second])?
        {
            return Ok(Some(time));
        }
        let numbers = TimeColumns::Numbers { column: first.clone(), second: 1.0 };
        match self.read_times(&first, numbers) {
            Ok(Some(times)) if times.is_steady() => self.time_of_column(draft, &first),
            // The column is a signal, or one of the signals.
            Ok(_) | Err(ProposalError::Backwards { .. } | ProposalError::Table(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn time_of_column(
        &self,
        draft: &Draft<'_>,
        name: &str,
    ) -> Result<Option<TableTime>, ProposalError> {
        let (column, names) = (name.to_owned(), self.names);
        let by_number = || name.parse::<usize>().ok()?.checked_sub(1);
        let place = names.columns.iter().position(|own| *own == name).or_else(by_number);
        let by_type = place.and_then(|place| names.seconds_per_unit.get(place).copied()).flatten();
        let second = by_type.unwrap_or(1.0);
        let numbers = TimeColumns::Numbers { column: column.clone(), second };
        let Some(times) = self.read_times(name, numbers)? else {
            let dates = TimeColumns::Dates { column: column.clone() };
            let time_source = TimeSource::Column { name: column, unit: Some(DATE_UNIT) };
            return self.time_without_unit(name, dates, time_source);
        };
        let rows_per_state = times.rows_per_state;
        let Some(rate_hz) = times.rate_hz else {
            let (time_source, rate_hz) = (TimeSource::Constant(column), None);
            return Ok(Some(TableTime { time_source, rate_hz, is_stated: false, rows_per_state }));
        };
        // The type of the column includes a unit, so the times are in seconds already.
        let rate_of = |unit: f64| rate_hz * second / unit;
        let by_type = UNIT_SECONDS.into_iter().find(|(_, second)| by_type == Some(*second));
        let by_type = by_type.map(|(unit, _)| Ok(unit.to_owned()));
        let in_row = place.and_then(|place| names.units.get(place)).map(|unit| format!("[{unit}]"));
        let unit_of = |name: &str| Some(unit(name, UNIT_WORDS)?.map(str::to_owned));
        let unit_found = draft.answered_text("data.time.unit").map(Ok).or(by_type);
        let own_name = place.and_then(|place| names.columns.get(place));
        let unit_found = unit_found.or_else(|| unit_of(own_name.map_or(name, String::as_str)));
        let unit_found = unit_found.or_else(|| unit_of(&in_row?));
        let is_stated = matches!(unit_found, Some(Ok(_)));
        let counts =
            times.times_s.windows(2).all(|pair| (pair[1] - pair[0] - 1.0).abs() < f64::EPSILON);
        let rates_hz = ProposalLimits::DEFAULT.rates_hz;
        let fits = match unit_found {
            Some(Ok(configured)) => UNIT_SECONDS.into_iter().find(|(unit, _)| *unit == configured),
            Some(Err(_)) => None,
            // The unit is ambiguous between a slow log in seconds and a fast log in milliseconds. A
            // row number is not a time.
            None if counts || (1.0..rates_hz.start).contains(&rate_of(1.0)) => None,
            None => {
                UNIT_SECONDS.into_iter().find(|(_, second)| rates_hz.contains(&rate_of(*second)))
            }
        };
        let (unit, rate_hz) =
            fits.map(|(unit, second)| (unit, round_rate(rate_of(second)))).unzip();
        let time_source = TimeSource::Column { name: column, unit };
        Ok(Some(TableTime { time_source, rate_hz, is_stated, rows_per_state }))
    }
}
