//! Resampling of rows with jittering times to a uniform grid.

use core::fmt;
use core::ops::Range;

use crate::row_times::mean_rate_hz;
use crate::time_limits::TimeLimits;

/// Distance below which a time is on the grid \[s\].
const ON_GRID_S: f64 = 1e-6;
/// Number of points of a cubic.
const MIN_CUBIC_POINTS: usize = 4;

/// Reason why rows form no record with this rate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TimesError {
    /// All times are the same. Take another source of the time, or the rows as they come.
    #[error(
        "all times are the same: they were written with few digits, or as 32-bit numbers. Write \
        more digits, or leave `time` out of [data]; in [data.bag], set `time` to \"log\" or \
        \"rows\""
    )]
    None,
    /// Time goes back.
    #[error(
        "time goes back at {time_s:.3} s after the first (row {row}): two publishers of the same \
        joints, or rows out of order. Record one of them alone; sort rows of one recording only"
    )]
    Backwards {
        /// Time after the first row \[s\].
        time_s: f64,
        /// Number of the row, from 1.
        row: usize,
    },
    /// The rate differs from the configured one.
    #[error(
        "{found_hz:.2} samples a second, and {stated_hz} are stated; state the rate that was \
        recorded (rate_hz)"
    )]
    Rate {
        /// Rate by the mean distance \[Hz\].
        found_hz: f64,
        /// Configured rate \[Hz\].
        stated_hz: f64,
    },
    /// Each state stands in several rows: state the rate of the states.
    #[error(
        "each state stands in {rows} rows: the arm sent {found_hz:.2} states a second, and the log \
        repeats them at {stated_hz} Hz. Set rate_hz to the rate of the states, and name the time"
    )]
    RepeatedStates {
        /// Number of rows of a state.
        rows: usize,
        /// Rate of the states \[Hz\].
        found_hz: f64,
        /// Configured rate \[Hz\].
        stated_hz: f64,
    },
    /// Too few rows.
    #[error("fewer than {MIN_CUBIC_POINTS} samples in one piece")]
    TooShort,
}

/// Changes of rows for a uniform grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resampled {
    /// Deviation of the times from the grid: root mean square \[s\].
    pub rms_s: f64,
    /// Largest deviation of a time from the grid \[s\].
    pub largest_s: f64,
    /// Number of rows that repeat the previous one or follow it immediately.
    pub repeated_rows: usize,
    /// Number of single missing rows that are interpolated.
    pub interpolated_rows: usize,
    /// Number of recordings after the first one in the same file.
    pub appended_recordings: usize,
    /// Number of steps back of the clock within a recording.
    pub clock_steps: usize,
    /// Number of rows of each state, of which one is kept; 0 if all rows are kept.
    pub rows_per_state: usize,
    /// Step of times that are coarser than the rows \[s\], which are then taken as uniform; 0 for
    /// fine times.
    pub coarse_step_s: f64,
}

impl Resampled {
    /// True if all rows were on the grid.
    pub fn is_nothing(&self) -> bool {
        let Self { appended_recordings, clock_steps, rows_per_state, coarse_step_s, .. } = *self;
        !self.is_resampled()
            && appended_recordings == 0
            && clock_steps == 0
            && rows_per_state == 0
            && coarse_step_s == 0.0
    }

    fn is_resampled(&self) -> bool {
        self.largest_s >= ON_GRID_S || self.repeated_rows > 0 || self.interpolated_rows > 0
    }
}

impl fmt::Display for Resampled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut texts = Vec::new();
        if self.is_resampled() {
            let (rms, largest) = (1e3 * self.rms_s, 1e3 * self.largest_s);
            texts.push(format!(
                "the times are {rms:.3} ms off a uniform grid in the root mean square, \
                {largest:.3} ms at most; the signals are resampled"
            ));
        }
        if self.repeated_rows > 0 {
            texts.push(format!(
                "{} rows repeat the one before or come right behind it, and are left out",
                self.repeated_rows
            ));
        }
        if self.interpolated_rows > 0 {
            let rows = self.interpolated_rows;
            texts.push(format!("{rows} rows that are missing alone are interpolated"));
        }
        if self.appended_recordings > 0 {
            texts.push(format!(
                "the file has {} recordings one after another; each is a piece of its own",
                self.appended_recordings + 1
            ));
        }
        if self.clock_steps > 0 {
            texts.push(format!(
                "the clock goes back {} times within the recording, as when it is set; the parts \
                before and after are pieces of their own",
                self.clock_steps
            ));
        }
        if self.rows_per_state > 0 {
            let rows = self.rows_per_state;
            texts.push(format!("each state stands in {rows} rows; one of them is kept"));
        }
        if self.coarse_step_s > 0.0 {
            texts.push(format!(
                "the times advance by {:.3} ms, less often than the rows, which are taken as \
                uniform; missing rows cannot be noticed within such a step",
                1e3 * self.coarse_step_s
            ));
        }
        f.write_str(&texts.join("; "))
    }
}

/// Columns of one length, with the times of their rows.
pub(crate) struct TimedRows {
    /// Time of each row after any instant \[s\].
    pub(crate) times_s: Vec<f64>,
    pub(crate) columns: Vec<Vec<f64>>,
}

/// A piece without gaps on the grid.
pub(crate) struct UniformPiece {
    /// Start time after the first row of the record \[s\].
    pub(crate) begins_s: f64,
    pub(crate) columns: Vec<Vec<f64>>,
}

/// Resamples complete parts to grids of the configured rate, by cubics through the four nearest
/// rows.
///
/// # Errors
/// [`TimesError`].
pub(crate) fn resample(
    rows: TimedRows,
    rate_hz: f64,
) -> Result<(Vec<UniformPiece>, Resampled), TimesError> {
    let period_s = 1.0 / rate_hz;
    let first_s = rows.times_s.first().copied().unwrap_or_default();
    if rows.times_s.len() > 1 && rows.times_s.iter().all(|time| *time <= first_s) {
        return Err(TimesError::None);
    }
    if let Some(row) = (1..rows.times_s.len()).find(|row: &usize| {
        let step = rows.times_s[*row] - rows.times_s[*row - 1];
        step < 0.0 || (step <= 0.0 && rows.changed_columns(*row) > 0)
    }) {
        return Err(TimesError::Backwards { time_s: rows.times_s[row] - first_s, row: row + 1 });
    }
    let (TimedRows { times_s, columns }, repeated) = without_repeats(rows, period_s);
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return Err(TimesError::TooShort);
    }
    let mut parts: Vec<Range<usize>> = Vec::new();
    let mut begin = 0;
    for end in 1..=times_s.len() {
        if steps.get(end - 1).is_none_or(|step| *step > TimeLimits::DEFAULT.gap_periods * period_s)
        {
            parts.push(begin..end);
            begin = end;
        }
    }
    let alone = steps.iter().filter(|step| {
        (TimeLimits::DEFAULT.missing_row_periods * period_s
            ..=TimeLimits::DEFAULT.gap_periods * period_s)
            .contains(*step)
    });
    let alone = alone.count();
    let found_hz = mean_rate_hz(&times_s).ok_or(TimesError::TooShort)?;
    if (found_hz / rate_hz - 1.0).abs() > TimeLimits::DEFAULT.resampled_rate {
        return Err(TimesError::Rate { found_hz, stated_hz: rate_hz });
    }
    parts.retain(|piece| piece.len() >= MIN_CUBIC_POINTS);
    if parts.is_empty() {
        return Err(TimesError::TooShort);
    }
    let mut off = GridDeviation::default();
    let part_list = parts
        .into_iter()
        .map(|piece: Range<usize>| {
            let times = &times_s[piece.clone()];
            let columns: Vec<&[f64]> =
                columns.iter().map(|column| &column[piece.clone()]).collect();
            let columns = interpolate_columns(times, &columns, period_s, &mut off);
            UniformPiece { begins_s: times[0] - first_s, columns }
        })
        .collect();
    let (rms_s, largest_s) = (off.rms_s(), off.largest_s);
    Ok((
        part_list,
        Resampled {
            rms_s,
            largest_s,
            repeated_rows: repeated,
            interpolated_rows: alone,
            ..Resampled::default()
        },
    ))
}

impl TimedRows {
    /// Returns the number of columns in which a row differs from the previous one.
    #[expect(clippy::float_cmp, reason = "what was sent again is the same to the bit")]
    fn changed_columns(&self, row: usize) -> usize {
        self.columns.iter().filter(|column| column[row] != column[row - 1]).count()
    }
}

/// Removes rows with the time of another row or immediately after it. It also removes repeated
/// states: single rows that equal the previous one, if most columns usually change between rows.
/// Returns the remaining rows and the number of removed ones.
fn without_repeats(rows: TimedRows, period_s: f64) -> (TimedRows, usize) {
    let (count, times_s) = (rows.times_s.len(), &rows.times_s);
    let moves = |row: usize| 2 * rows.changed_columns(row) > rows.columns.len();
    let repeats = |row: usize| -> bool {
        if row == 0 || rows.changed_columns(row) > 0 {
            return false;
        }
        let alone = row > 1 && row + 1 < count && moves(row - 1) && moves(row + 1);
        alone && times_s[row + 1] - times_s[row - 1] <= TimeLimits::DEFAULT.gap_periods * period_s
    };
    let mut rows_kept: Vec<usize> = Vec::with_capacity(count);
    for row in 0..count {
        let near = rows_kept.last().is_some_and(|last| {
            times_s[row] - times_s[*last] < TimeLimits::DEFAULT.duplicate_periods * period_s
        });
        if !near && !repeats(row) {
            rows_kept.push(row);
        }
    }
    let repeated = count - rows_kept.len();
    if repeated == 0 {
        return (rows, 0);
    }
    let values_of =
        |column: &Vec<f64>| -> Vec<f64> { rows_kept.iter().map(|row| column[*row]).collect() };
    (
        TimedRows {
            times_s: values_of(times_s),
            columns: rows.columns.iter().map(values_of).collect(),
        },
        repeated,
    )
}

/// Deviation of times from the grid.
#[derive(Default)]
struct GridDeviation {
    sum_of_squares: f64,
    count: f64,
    largest_s: f64,
}

impl GridDeviation {
    fn add(&mut self, off_s: f64) {
        self.sum_of_squares += off_s * off_s;
        self.count += 1.0;
        self.largest_s = self.largest_s.max(off_s);
    }

    fn rms_s(&self) -> f64 {
        (self.sum_of_squares / self.count).sqrt()
    }
}

fn interpolate_columns(
    times: &[f64],
    columns: &[&[f64]],
    period_s: f64,
    off: &mut GridDeviation,
) -> Vec<Vec<f64>> {
    let (start, end) = (times[0], times[times.len() - 1]);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "samples in memory are far fewer than 2^52"
    )]
    let count = ((end - start) / period_s + 1e-6).floor() as usize + 1;
    let mut on_grid = vec![Vec::with_capacity(count); columns.len()];
    let mut next = 0;
    for k in 0..count {
        #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
        let time = start + k as f64 * period_s;
        while next + 2 < times.len() && times[next + 1] <= time {
            next += 1;
        }
        off.add((times[next] - time).abs().min((times[next + 1] - time).abs()));
        let first = next.saturating_sub(1).min(times.len() - MIN_CUBIC_POINTS);
        let weights = cubic_weights(&times[first..first + MIN_CUBIC_POINTS], time);
        for (on_grid, column) in on_grid.iter_mut().zip(columns) {
            let near = column[first..first + MIN_CUBIC_POINTS].iter().zip(weights);
            on_grid.push(near.map(|(value, weight)| weight * value).sum());
        }
    }
    on_grid
}

/// Returns the weights of four points in the cubic through them (Lagrange).
fn cubic_weights(times: &[f64], time: f64) -> [f64; MIN_CUBIC_POINTS] {
    core::array::from_fn(|k| {
        let others = times.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, other)| (time - other) / (times[k] - other)).product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine at 100 Hz whose times are off by up to a fifth of a period.
    fn rows(of: impl Iterator<Item = u32>) -> TimedRows {
        let times_s: Vec<f64> =
            of.map(|k| 0.01 * (f64::from(k) + 0.2 * (f64::from(k) * 1.7).sin())).collect();
        let columns = vec![times_s.iter().map(|t| (3.0 * t).sin()).collect(), times_s.clone()];
        TimedRows { times_s, columns }
    }

    #[test]
    fn what_is_missing_cuts_and_what_jitters_is_resampled() {
        let (parts, resampled) =
            resample(rows((0..400).filter(|k| !(100..103).contains(k))), 100.0).unwrap();
        let starts: Vec<f64> = parts.iter().map(|piece| (piece.begins_s * 100.0).round()).collect();
        assert_eq!(starts, [0.0, 103.0]);
        assert!((1e-3..2e-3).contains(&resampled.rms_s), "{resampled}");
        for piece in &parts {
            assert!(piece.columns[0].len() > 98);
            for (sine, time) in piece.columns[0].iter().zip(&piece.columns[1]) {
                assert!((sine - (3.0 * time).sin()).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_state_that_is_sent_again_in_motion_is_left_out_and_rest_is_not() {
        let mut moving = rows(0..50);
        for column in &mut moving.columns {
            column[20] = column[19];
        }
        let (parts, resampled) = resample(moving, 100.0).unwrap();
        assert_eq!(resampled.repeated_rows, 1);
        assert!((parts[0].columns[0][20] - (3.0 * parts[0].columns[1][20]).sin()).abs() < 1e-6);
        let mut resting = rows(0..50);
        resting.columns.iter_mut().for_each(|column| column.fill(1.0));
        assert_eq!(resample(resting, 100.0).unwrap().1.repeated_rows, 0);
    }

    #[test]
    fn one_missing_row_is_counted_and_one_right_behind_another_is_left_out() {
        let (parts, resampled) = resample(rows((0..100).filter(|k| *k != 40)), 100.0).unwrap();
        assert_eq!((parts.len(), resampled.interpolated_rows), (1, 1));
        assert!(resampled.to_string().contains("1 rows that are missing alone are interpolated"));
        // A microsecond behind, and off by noise: a cubic through both would leave the limits.
        let mut behind = rows(0..100);
        let (time, off) = (behind.times_s[50] + 1e-6, [0.01, 0.0]);
        behind.times_s.insert(51, time);
        for (column, off) in behind.columns.iter_mut().zip(off) {
            column.insert(51, column[50] + off);
        }
        let (parts, resampled) = resample(behind, 100.0).unwrap();
        assert_eq!(resampled.repeated_rows, 1);
        for (sine, time) in parts[0].columns[0].iter().zip(&parts[0].columns[1]) {
            assert!((sine - (3.0 * time).sin()).abs() < 1e-6);
        }
    }

    #[test]
    fn times_of_no_record_are_refused() {
        let refused = |rows: TimedRows, rate_hz| resample(rows, rate_hz).err().unwrap();
        let mut back = rows(0..50);
        back.times_s.swap(30, 31);
        assert!(matches!(refused(back, 100.0), TimesError::Backwards { row: 32, .. }));
        let mut stopped = rows(0..50);
        stopped.times_s.fill(7.0);
        assert_eq!(refused(stopped, 100.0), TimesError::None);
        assert!(matches!(refused(rows(0..50), 250.0), TimesError::Rate { .. }));
        assert_eq!(refused(rows(0..3), 100.0), TimesError::TooShort);
        assert_eq!(refused(rows(0..0), 100.0), TimesError::TooShort);
    }
}
