//! Sentences about drift.

use super::limits::DriftLimits;
use super::{Change, Trend};
use crate::archive::store::Timestamp;
use crate::text::significant_digits;

/// Returns a sentence such as
/// `fc3 has grown by 12.3 % ± 0.4 % since the baseline of 2026-11-22, +0.41 ± 0.02 %/day, left its
/// band on 2026-12-20`.
/// A parameter whose baseline could be zero is reported in its unit.
pub fn change_sentence(
    change: &Change,
    baseline: Timestamp,
    trend: Option<&Trend>,
    outside_since: Option<Timestamp>,
) -> String {
    let relative = change.baseline.abs() > 2.0 * change.standard_deviation;
    let (scale, unit) = if relative { (100.0 / change.baseline, " %") } else { (1.0, "") };
    let (by, deviation) = (change.difference * scale, change.standard_deviation * scale.abs());
    let verb = match (relative, by >= 0.0) {
        (true, true) => "has grown by",
        (true, false) => "has shrunk by",
        (false, true) => "has risen by",
        (false, false) => "has fallen by",
    };
    let mut text = format!(
        "{} {verb} {}{unit} ± {}{unit} since the baseline{}",
        change.parameter,
        to_the_digit_of(by.abs(), deviation),
        significant_digits(deviation, 1),
        if baseline.is_set() { format!(" of {}", baseline.date()) } else { String::new() }
    );
    if let Some(trend) = trend {
        let (slope, deviation) = (trend.slope * scale, trend.slope_deviation * scale.abs());
        let sign = if slope < 0.0 { '−' } else { '+' };
        let per = if relative { " %/day" } else { "/day" };
        let slope = to_the_digit_of(slope.abs(), deviation);
        text += &format!(", {sign}{slope} ± {}{per}", significant_digits(deviation, 1));
    }
    if let Some(since) = outside_since {
        text += ", left its band ";
        text += &match since.is_set() {
            true => format!("on {}", since.date()),
            false => "while the clock was not set".to_owned(),
        };
    } else if let Some(day) = trend.and_then(|trend| band_exit(change, baseline, trend)) {
        text += &format!(", leaves its band on {} at this rate", day.date());
    }
    text
}

/// Returns the time at which the trend line leaves the band. `None` if the slope is not
/// significant, or if the time is beyond the allowed extrapolation of the trend. Times of the trend
/// are days since the baseline.
pub fn band_exit(change: &Change, baseline: Timestamp, trend: &Trend) -> Option<Timestamp> {
    if trend.slope.abs() < DriftLimits::DEFAULT.slope_deviations * trend.slope_deviation
        || change.band_share() > 1.0
    {
        return None;
    }
    let edge = change.baseline + change.half_band * trend.slope.signum();
    let leaves = trend.mean_time + (edge - trend.at_mean) / trend.slope;
    let (first, last) = trend.span;
    let reach = last + DriftLimits::DEFAULT.forecast_spans * (last - first);
    (leaves.is_finite() && leaves > last && leaves <= reach).then(|| baseline.plus_days(leaves))?
}

/// Formats a number down to the decimal place of the first digit of its standard deviation.
fn to_the_digit_of(value: f64, deviation: f64) -> String {
    if !(deviation > 0.0 && deviation.is_finite() && value.is_finite()) {
        return significant_digits(value, 3);
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to 12 decimal places"
    )]
    let decimals = (-deviation.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}
