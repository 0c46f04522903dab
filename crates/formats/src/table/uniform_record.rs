//! A record on a uniform grid from the rows of a table.

use std::path::Path;

use super::Table;
use super::error::TableError;
use super::grid::Grid;
use crate::record::Record;
use crate::row_times::{distinct_rows, held_rows, join_recordings};
use crate::time_limits::TimeLimits;
use crate::uniform::{Resampled, TimedRows, TimesError, resample};

/// Converts complete rows to a record.
pub(super) fn to_record(
    mut table: Table,
    path: &Path,
    sample_rate_hz: Option<f64>,
    nominal_hz: f64,
) -> Result<Record, TableError> {
    let held = table.keep_distinct_rows(sample_rate_hz);
    let second = table.second;
    if !table.begins.is_empty() && table.time.is_none() {
        table.time = sample_rate_hz.map(|rate_hz| row_times(0..table.rows(), rate_hz));
    }
    // Times jitter if they are off the grid by more than their last digits.
    let is_on_grid = |grid: &Grid, resolution_s: f64| {
        let jitter_s = TimeLimits::DEFAULT.grid_jitter_periods / grid.rate_hz;
        grid.coarse_step_s > 0.0 || grid.off_s <= (2.0 * resolution_s).max(jitter_s)
    };
    let grid = table.grid(sample_rate_hz, path);
    let record = match grid {
        Ok(grid) if table.begins.is_empty() && is_on_grid(&grid, table.resolution_s) => {
            let mut record = Record::from(table.into_measurement(grid.rate_hz));
            record.resampled.coarse_step_s = grid.coarse_step_s;
            Ok(record)
        }
        Ok(_) | Err(TableError::NotUniform { .. }) => {
            let mut times_s = table.time.take().unwrap_or_default();
            // Where time goes back within a recording, the resampling says it.
            let appended = join_recordings(&mut times_s, &table.begins).unwrap_or_default();
            let columns = table.signals.iter_mut().flat_map(core::mem::take).collect();
            let (rate, axes) = (sample_rate_hz.unwrap_or(nominal_hz), table.axes);
            let uniform = resample(TimedRows { times_s, columns }, rate)
                .map_err(|source| TableError::Times { file: path.to_path_buf(), source });
            uniform.map(|(pieces, resampled)| {
                let resampled = Resampled { appended_recordings: appended, ..resampled };
                Record::from_uniform((pieces, resampled), |columns| {
                    let mut columns = columns.into_iter();
                    let signals = [(); 3].map(|()| columns.by_ref().take(axes).collect());
                    Table { signals, ..table.clone() }.into_measurement(rate)
                })
            })
        }
        Err(error) => Err(error),
    };
    match record {
        Ok(mut record) => {
            record.resampled.held_rows = held.unwrap_or_default();
            Ok(record)
        }
        Err(error) => {
            let cause = rate_difference(&error).and_then(|(found_hz, given_hz)| {
                let file = path.to_path_buf();
                let source =
                    held.map(|rows| TimesError::Held { rows, found_hz, stated_hz: given_hz });
                let held = source.map(|source| TableError::Times { file: file.clone(), source });
                held.or_else(|| {
                    let second = fitting_unit(found_hz / given_hz, second)?;
                    Some(TableError::TimeScale { file, found_hz, given_hz, second })
                })
            });
            Err(cause.unwrap_or(error))
        }
    }
}

/// Returns the times of rows by their numbers \[s\].
#[expect(clippy::cast_precision_loss, reason = "rows in memory are far fewer than 2^52")]
pub(super) fn row_times(rows: impl Iterator<Item = usize>, rate_hz: f64) -> Vec<f64> {
    rows.map(|row| row as f64 / rate_hz).collect()
}

/// Returns the rate of the times and the configured one \[Hz\], if they differ.
fn rate_difference(error: &TableError) -> Option<(f64, f64)> {
    match error {
        TableError::RateMismatch { found_hz, given_hz, .. } => Some((*found_hz, *given_hz)),
        TableError::Times { source: TimesError::Rate { found_hz, stated_hz }, .. } => {
            Some((*found_hz, *stated_hz))
        }
        _ => None,
    }
}

/// Returns the unit of time \[s\] that fits a rate which is off by this factor with another unit.
fn fitting_unit(factor: f64, second: f64) -> Option<f64> {
    let is_other = |unit: &f64| (unit / second - 1.0).abs() > 0.5;
    let mut units = [1.0, 1e-3, 1e-6, 1e-9].into_iter().filter(is_other);
    let error = |unit: &f64| (factor * second / unit - 1.0).abs();
    units.find(|unit| error(unit) < TimeLimits::DEFAULT.resampled_rate)
}

impl Table {
    fn rows(&self) -> usize {
        self.signals.iter().flatten().map(Vec::len).max().unwrap_or_default()
    }

    /// Keeps one row of each state, if each stands in several rows. Returns their number.
    fn keep_distinct_rows(&mut self, sample_rate_hz: Option<f64>) -> Option<usize> {
        let held = self.held_rows()?;
        let columns: Vec<&Vec<f64>> = self.signals.iter().flatten().collect();
        let rows = distinct_rows(&columns, held);
        let keep = |column: &mut Vec<f64>| {
            *column = rows.iter().filter_map(|row| column.get(*row).copied()).collect();
        };
        match &mut self.time {
            Some(time) => keep(time),
            time => {
                *time = sample_rate_hz.map(|rate_hz| row_times(rows.iter().copied(), rate_hz));
            }
        }
        self.signals.iter_mut().flatten().for_each(keep);
        for begin in &mut self.begins {
            *begin = rows.partition_point(|row| row < begin);
        }
        Some(held)
    }

    /// Returns the number of rows in which each state stands, if most stand in several: a log that
    /// is faster than the arm.
    pub fn held_rows(&self) -> Option<usize> {
        held_rows(&self.signals.iter().flatten().collect::<Vec<_>>())
    }
}
