//! A record on a uniform grid from the rows of a table.

use std::path::Path;

use super::error::TableError;
use super::grid::Grid;
use super::rows::Table;
use crate::record::Record;
use crate::row_times::{distinct_rows, join_recordings, rows_per_state};
use crate::time_limits::TimeLimits;
use crate::uniform::{TimedRows, TimesError, resample};

/// Converts complete rows to a record.
pub(super) fn to_record(
    mut table: Table,
    path: &Path,
    sample_rate_hz: Option<f64>,
    nominal_hz: f64,
) -> Result<Record, TableError> {
    let rows_per_state = table.keep_distinct_rows(sample_rate_hz);
    let (resolution_s, second) = (table.resolution_s, table.second);
    if !table.begins.is_empty() && table.time.is_none() {
        table.time = sample_rate_hz.map(|rate_hz| row_times(0..table.rows(), rate_hz));
    }
    let record = match table.grid(sample_rate_hz, path) {
        Ok(grid) if table.begins.is_empty() && grid.has_fitting_times(resolution_s) => {
            let mut record = Record::from(table.into_measurement(grid.rate_hz));
            record.resampled.coarse_step_s = grid.coarse_step_s;
            Ok(record)
        }
        Ok(_) | Err(TableError::NotUniform { .. }) => {
            table.into_resampled(path, sample_rate_hz.unwrap_or(nominal_hz))
        }
        Err(error) => Err(error),
    };
    match record {
        Ok(mut record) => {
            record.resampled.rows_per_state = rows_per_state.unwrap_or_default();
            Ok(record)
        }
        Err(error) => Err(rate_cause(&error, path, rows_per_state, second).unwrap_or(error)),
    }
}

/// Returns the times of rows by their numbers \[s\].
#[expect(clippy::cast_precision_loss, reason = "rows in memory are far fewer than 2^52")]
pub(super) fn row_times(rows: impl Iterator<Item = usize>, rate_hz: f64) -> Vec<f64> {
    rows.map(|row| row as f64 / rate_hz).collect()
}

/// Explains another rate: by the rows in which each state stands, or by another unit of the times.
fn rate_cause(
    error: &TableError,
    path: &Path,
    rows_per_state: Option<usize>,
    second: f64,
) -> Option<TableError> {
    let (found_hz, given_hz) = match error {
        TableError::RateMismatch { found_hz, given_hz, .. } => (*found_hz, *given_hz),
        TableError::Times { source: TimesError::Rate { found_hz, stated_hz }, .. } => {
            (*found_hz, *stated_hz)
        }
        _ => return None,
    };
    let file = path.to_path_buf();
    if let Some(rows) = rows_per_state {
        let source = TimesError::RepeatedStates { rows, found_hz, stated_hz: given_hz };
        return Some(TableError::Times { file, source });
    }
    let second = fitting_unit(found_hz / given_hz, second)?;
    Some(TableError::TimeScale { file, found_hz, given_hz, second })
}

/// Returns the unit of time \[s\] that fits a rate which is off by this factor with another unit.
fn fitting_unit(factor: f64, second: f64) -> Option<f64> {
    let is_other = |unit: &f64| (unit / second - 1.0).abs() > 0.5;
    let mut units = [1.0, 1e-3, 1e-6, 1e-9].into_iter().filter(is_other);
    let error = |unit: &f64| (factor * second / unit - 1.0).abs();
    units.find(|unit| error(unit) < TimeLimits::DEFAULT.resampled_rate)
}

/// Keeps some rows of a column.
fn retain_rows(column: &mut Vec<f64>, rows: &[usize]) {
    *column = rows.iter().filter_map(|row| column.get(*row).copied()).collect();
}

impl Grid {
    /// Returns true if the times are off the grid by no more than their last digits, or by their
    /// steps, if these are coarser than the rows. Other times jitter.
    fn has_fitting_times(&self, resolution_s: f64) -> bool {
        let jitter_s = TimeLimits::DEFAULT.grid_jitter_periods / self.rate_hz;
        self.coarse_step_s > 0.0 || self.off_s <= (2.0 * resolution_s).max(jitter_s)
    }
}

impl Table {
    /// Resamples the rows to a rate \[Hz\]. Recordings one after another become pieces.
    fn into_resampled(mut self, path: &Path, rate_hz: f64) -> Result<Record, TableError> {
        let mut times_s = self.time.take().unwrap_or_default();
        // If time goes back from row to row, the resampling says it.
        let joined = join_recordings(&mut times_s, &self.begins).unwrap_or_default();
        let columns = self.signals.iter_mut().flat_map(core::mem::take).collect();
        let (parts, mut resampled) = resample(TimedRows { times_s, columns }, rate_hz)
            .map_err(|source| TableError::Times { file: path.to_path_buf(), source })?;
        resampled.appended_recordings = joined.recordings;
        resampled.clock_steps = joined.clock_steps;
        Ok(Record::from_uniform((parts, resampled), |columns| {
            let mut columns = columns.into_iter();
            let signals = [(); 3].map(|()| columns.by_ref().take(self.axes).collect());
            Table { signals, ..self.clone() }.into_measurement(rate_hz)
        }))
    }

    fn rows(&self) -> usize {
        self.signals.iter().flatten().map(Vec::len).max().unwrap_or_default()
    }

    /// Keeps one row of each state, if each stands in several rows. Returns their number.
    fn keep_distinct_rows(&mut self, sample_rate_hz: Option<f64>) -> Option<usize> {
        let rows_per_state = self.rows_per_state()?;
        let columns: Vec<&Vec<f64>> = self.signals.iter().flatten().collect();
        let rows = distinct_rows(&columns, rows_per_state);
        match &mut self.time {
            Some(time) => retain_rows(time, &rows),
            time => {
                *time = sample_rate_hz.map(|rate_hz| row_times(rows.iter().copied(), rate_hz));
            }
        }
        self.signals.iter_mut().flatten().for_each(|column| retain_rows(column, &rows));
        for begin in &mut self.begins {
            *begin = rows.partition_point(|row| row < begin);
        }
        Some(rows_per_state)
    }

    /// Returns the number of rows in which each state stands, if most stand in several: a log that
    /// is faster than the arm.
    pub fn rows_per_state(&self) -> Option<usize> {
        rows_per_state(&self.signals.iter().flatten().collect::<Vec<_>>())
    }
}
