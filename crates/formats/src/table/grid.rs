//! Uniform grid of a table's times.

use std::path::Path;

use super::error::TableError;
use super::place::RowPlace;
use crate::row_times::{coarse_step_s, line_through};
use crate::time_limits::TimeLimits;

/// A uniform grid of times.
pub(super) struct Grid {
    pub(super) rate_hz: f64,
    /// Largest distance of a time from the grid \[s\].
    pub(super) off_s: f64,
    /// Step of times that are coarser than the rows \[s\]; 0 for fine times.
    pub(super) coarse_step_s: f64,
}

/// Returns the grid of a table whose times, if any, are uniform.
pub(super) fn find_grid(
    time_s: Option<&[f64]>,
    first_row: RowPlace,
    declared: Option<f64>,
    path: &Path,
) -> Result<Grid, TableError> {
    let file = || path.to_path_buf();
    let Some(time) = time_s else {
        let rate_hz = declared.ok_or(TableError::NoTime { file: file() })?;
        return Ok(Grid { rate_hz, off_s: 0.0, coarse_step_s: 0.0 });
    };
    let grid = uniform(time, first_row, path)?;
    let Grid { rate_hz: found_hz, off_s, .. } = grid;
    let Some(given_hz) = declared else { return Ok(grid) };
    // Rounded times leave the rate uncertain by this share.
    let lasts_s = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first);
    if (found_hz / given_hz - 1.0).abs() > TimeLimits::DEFAULT.same_rate + 2.0 * off_s / lasts_s {
        return Err(TableError::RateMismatch { file: file(), found_hz, given_hz });
    }
    Ok(Grid { rate_hz: given_hz, ..grid })
}

/// Returns the grid of a uniform time column. The error names the first row off the grid.
///
/// The grid runs from the first to the last time, so that rounding of the times does not
/// accumulate. If the times do not fit it, there is a gap. The median step, which a gap does not
/// change, then locates the gap.
#[expect(clippy::cast_precision_loss, reason = "rows are far fewer than 2^52")]
fn uniform(time_s: &[f64], first_row: RowPlace, path: &Path) -> Result<Grid, TableError> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else {
        return Err(TableError::TooShort { file: path.to_path_buf() });
    };
    let coarse_step_s = coarse_step_s(time_s).unwrap_or_default();
    let mean = (last - first) / (time_s.len() - 1) as f64;
    let (first, mean) = if coarse_step_s > 0.0 { line_through(time_s) } else { (*first, mean) };
    let distances = |period: f64| {
        let rows = time_s.iter().enumerate();
        rows.map(move |(row, time)| (time - (first + row as f64 * period)).abs())
    };
    let leaves_grid = |period: f64| {
        distances(period)
            .position(|is| period <= 0.0 || is > TimeLimits::DEFAULT.grid_periods * period)
    };
    if coarse_step_s > 0.0 {
        let off_s = distances(mean).fold(0.0, f64::max);
        if off_s <= coarse_step_s {
            return Ok(Grid { rate_hz: 1.0 / mean, off_s, coarse_step_s });
        }
    }
    if leaves_grid(mean).is_none() {
        let off_s = distances(mean).fold(0.0, f64::max);
        return Ok(Grid { rate_hz: 1.0 / mean, off_s, coarse_step_s: 0.0 });
    }
    let mut steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let median = steps[steps.len() / 2];
    let row = leaves_grid(median).unwrap_or(time_s.len() - 1);
    Err(TableError::NotUniform {
        file: path.to_path_buf(),
        place: first_row.rows_later(row),
        time_s: time_s[row],
        expected_s: first + row as f64 * median,
        sample_rate_hz: 1.0 / median,
    })
}
