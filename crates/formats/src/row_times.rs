//! Times of rows as loggers write them: their rate, recordings one after another, stamps that are
//! coarser than the rows, and states that stand in several rows.

use crate::time_limits::TimeLimits;

/// Returns the rate of times \[Hz\] from the mean of the distances without losses; `None` if the
/// times do not advance. If many distances are longer and cover most of the time, the rows come in
/// bursts, and all distances count. Times that are coarser than the rows give the rate of the whole
/// record.
pub fn mean_rate_hz(times_s: &[f64]) -> Option<f64> {
    if coarse_step_s(times_s).is_some() {
        return Some(1.0 / line_through(times_s).1);
    }
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let median = *steps.get(steps.len() / 2)?;
    // The distances are sorted, so the long ones are at the end. Each counts with the usual length,
    // so that a pause has no weight.
    let plain =
        steps.partition_point(|step| *step < TimeLimits::DEFAULT.missing_row_periods * median);
    let (near, distant) = steps.split_at(plain);
    #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
    if let Some(usual) = distant
        .get(distant.len() / 2)
        .filter(|_| TimeLimits::DEFAULT.burst_distances * distant.len() > steps.len())
    {
        let [near_s, distant_s] = [near.iter().sum::<f64>(), distant.len() as f64 * usual];
        if distant_s > near_s {
            return Some(steps.len() as f64 / (near_s + distant_s));
        }
    }
    steps.retain(|step| *step > 0.0 && *step < TimeLimits::DEFAULT.missing_row_periods * median);
    #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
    let count = steps.len() as f64;
    (count > 0.0).then(|| count / steps.iter().sum::<f64>())
}

/// Returns the step of times that are coarser than the rows \[s\], as those with two decimals or of
/// 32 bits: many rows repeat the time of the row before.
pub(crate) fn coarse_step_s(times_s: &[f64]) -> Option<f64> {
    let steps = || times_s.windows(2).map(|pair| pair[1] - pair[0]);
    let repeats = steps().filter(|step| *step == 0.0).count();
    if TimeLimits::DEFAULT.burst_distances * repeats < times_s.len() {
        return None;
    }
    let mut advances: Vec<f64> = steps().filter(|step| *step > 0.0).collect();
    advances.sort_unstable_by(f64::total_cmp);
    let step_s = *advances.get(advances.len() / 2)?;
    let (_, period_s) = line_through(times_s);
    (step_s > TimeLimits::DEFAULT.missing_row_periods * period_s).then_some(step_s)
}

/// Returns the straight line through the times, by least squares: the time of row 0 and the
/// distance of two rows \[s\].
#[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
pub(crate) fn line_through(times_s: &[f64]) -> (f64, f64) {
    let count = times_s.len() as f64;
    let [middle, mean_s] = [(count - 1.0) / 2.0, times_s.iter().sum::<f64>() / count];
    let rows = times_s.iter().enumerate().map(|(row, time)| (row as f64 - middle, time - mean_s));
    let (both, square) = rows
        .fold((0.0, 0.0), |(both, square), (row, time)| (both + row * time, square + row * row));
    let period_s = both / square;
    (mean_s - middle * period_s, period_s)
}

/// Parts of a file after the first one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct JoinedParts {
    /// Number of other recordings.
    pub(crate) recordings: usize,
    /// Number of steps back of the clock within a recording.
    pub(crate) clock_steps: usize,
}

/// Shifts recordings that stand one after another, so that time never goes back between them.
/// `begins` are rows at which a recording is known to begin; others begin where time falls by a
/// large share of the recording before. Where time falls by less, the clock was set.
///
/// # Errors
/// The first row, from 0, at which time goes back without many rows before and after it: rows that
/// are out of order, or two recordings with alternating rows.
pub(crate) fn join_recordings(times_s: &mut [f64], begins: &[usize]) -> Result<JoinedParts, usize> {
    let limits = TimeLimits::DEFAULT;
    let falls = (1..times_s.len()).filter(|row| times_s[*row] < times_s[*row - 1]);
    let mut parts: Vec<usize> =
        [0].into_iter().chain(falls).chain(begins.iter().copied()).collect();
    parts.sort_unstable();
    parts.dedup();
    if parts.len() == 1 {
        return Ok(JoinedParts::default());
    }
    let ends = parts[1..].iter().copied().chain([times_s.len()]);
    let is_short = |begin: &usize, end: usize| end - begin < limits.recording_rows;
    let short: Vec<bool> =
        parts.iter().zip(ends).map(|(begin, end)| is_short(begin, end)).collect();
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let period_s = steps.get(steps.len() / 2).copied().unwrap_or_default();
    let pause_s = limits.restart_periods * period_s;
    let mut joined = JoinedParts::default();
    for (part, row) in parts.iter().enumerate().skip(1) {
        let lasts_s = times_s[*row - 1] - times_s[parts[part - 1]];
        let falls_s = times_s[*row - 1] - times_s[*row];
        let begins_again = falls_s >= limits.restart_share * lasts_s;
        let is_known = begins.contains(row) || falls_s <= 0.0;
        // Rows that are out of order fall by less.
        let is_step = begins_again || falls_s > limits.gap_periods * period_s;
        if !is_known && (!is_step || short[part - 1] || short[part]) {
            return Err(*row);
        }
        match is_known || begins_again {
            true => joined.recordings += 1,
            false => joined.clock_steps += 1,
        }
    }
    for row in &parts[1..] {
        let shift_s = times_s[*row - 1] + pause_s - times_s[*row];
        if shift_s > 0.0 {
            times_s[*row..].iter_mut().for_each(|time| *time += shift_s);
        }
    }
    Ok(joined)
}

/// Returns the row, from 1, at which the times of a table go back, if they do. Recordings one after
/// another and steps of the clock do not count, and are joined.
pub fn join_times(times_s: &mut [f64]) -> Option<usize> {
    join_recordings(times_s, &[]).err().map(|row| row + 1)
}

/// Returns the number of rows in which each state stands, if most states stand in several rows: a
/// log that is faster than the arm.
pub(crate) fn rows_per_state(columns: &[&Vec<f64>]) -> Option<usize> {
    let mut runs: Vec<usize> = run_begins(columns).windows(2).map(|run| run[1] - run[0]).collect();
    runs.sort_unstable();
    let usual = *runs.get(runs.len() / 2)?;
    let alike = runs.iter().filter(|run| **run == usual).count();
    let (many, most) = (runs.len() >= TimeLimits::DEFAULT.recording_rows, 2 * alike > runs.len());
    (usual > 1 && many && most).then_some(usual)
}

/// Returns one row of each state, if each stands in `rows_per_state` rows. A longer rest has as
/// many states.
pub(crate) fn distinct_rows(columns: &[&Vec<f64>], rows_per_state: usize) -> Vec<usize> {
    let count = columns.first().map_or(0, |column| column.len());
    let begins = run_begins(columns);
    let ends = begins.iter().skip(1).copied().chain([count]);
    begins.iter().zip(ends).flat_map(|(begin, end)| (*begin..end).step_by(rows_per_state)).collect()
}

/// Returns the rows that differ from the row before.
#[expect(clippy::float_cmp, reason = "a repeated state is the same to the bit")]
fn run_begins(columns: &[&Vec<f64>]) -> Vec<usize> {
    let count = columns.first().map_or(0, |column| column.len());
    let differs =
        |row: &usize| *row == 0 || columns.iter().any(|column| column[*row] != column[*row - 1]);
    (0..count).filter(differs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_bursts_is_that_of_all_rows_and_losses_change_none() {
        let close = |times: Vec<f64>, rate_hz: f64| {
            let rate = mean_rate_hz(&times).unwrap();
            assert!((rate / rate_hz - 1.0).abs() < 0.01, "{rate}");
        };
        // Five rows every 20 ms.
        close(
            (0..2500).map(|k| 0.02 * f64::from(k / 5) + 2e-4 * f64::from(k % 5)).collect(),
            250.0,
        );
        // A tenth of the rows is lost, and a minute.
        let lost_times = (0..2500).filter(|k| k % 10 != 3);
        close(
            lost_times.map(|k| 0.004 * f64::from(k) + if k > 2000 { 60.0 } else { 0.0 }).collect(),
            250.0,
        );
        assert_eq!(mean_rate_hz(&[1.0, 1.0, 1.0]), None);
    }

    #[test]
    fn coarse_stamps_give_the_rate_of_the_whole_record() {
        let stamps = |step: f64| -> Vec<f64> {
            (0..3000).map(|row| (f64::from(row) / 500.0 / step).round() * step).collect()
        };
        for step in [0.01, 1.0 / 256.0] {
            let times = stamps(step);
            let found = coarse_step_s(&times).unwrap();
            assert!((found - step).abs() < 1e-9, "{found}");
            let rate = mean_rate_hz(&times).unwrap();
            assert!((rate / 500.0 - 1.0).abs() < 3e-4, "{rate}");
        }
        assert_eq!(coarse_step_s(&stamps(1e-4)), None);
        // A row that came twice is no coarse stamp.
        let mut twice = stamps(1e-4);
        twice[100] = twice[99];
        assert_eq!(coarse_step_s(&twice), None);
    }

    #[test]
    fn recordings_one_after_another_and_parts_around_a_clock_step_are_joined() {
        let ramp = || (0..300).map(|row| f64::from(row) * 0.01);
        let mut twice: Vec<f64> = ramp().chain(ramp()).collect();
        let recordings = |recordings| Ok(JoinedParts { recordings, clock_steps: 0 });
        assert_eq!(join_recordings(&mut twice, &[]), recordings(1));
        assert!((twice[300] - twice[299] - 0.1).abs() < 1e-9 && twice.is_sorted());
        let mut marked: Vec<f64> = (0..600).map(|row| f64::from(row) * 0.01).collect();
        assert_eq!(join_recordings(&mut marked, &[300]), recordings(1));
        assert!((marked[300] - marked[299] - 0.1).abs() < 1e-9);
        let set_back = ramp().map(|time_s| if time_s < 1.5 { time_s } else { time_s - 0.5 });
        let mut set_back: Vec<f64> = set_back.collect();
        let steps = JoinedParts { recordings: 0, clock_steps: 1 };
        assert_eq!(join_recordings(&mut set_back, &[]), Ok(steps));
        assert!((set_back[150] - set_back[149] - 0.1).abs() < 1e-9 && set_back.is_sorted());
        let mut swapped: Vec<f64> = ramp().collect();
        swapped.swap(150, 151);
        assert_eq!(join_times(&mut swapped), Some(152));
        let mut alternating: Vec<f64> = ramp().flat_map(|time| [time + 50.0, time]).collect();
        assert!(join_recordings(&mut alternating, &[]).is_err());
    }

    #[test]
    fn states_that_stand_in_several_rows_are_found() {
        let stepped: Vec<f64> = (0..2000).map(|row| f64::from(row / 4)).collect();
        let other: Vec<f64> = stepped.iter().map(|value| -value).collect();
        assert_eq!(rows_per_state(&[&stepped, &other]), Some(4));
        assert_eq!(distinct_rows(&[&stepped, &other], 4).len(), 500);
        let fresh: Vec<f64> = (0..2000).map(f64::from).collect();
        assert_eq!(rows_per_state(&[&stepped, &fresh]), None);
    }
}
