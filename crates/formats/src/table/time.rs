//! Times of rows, exact to the nanosecond. A double that counts seconds from 1970 has steps of a
//! quarter of a microsecond, 0.1 % of a period at 4 kHz. So the first time is subtracted before
//! anything is rounded.

use std::time::{Duration, SystemTime};

/// A number as the sum of an integer and a fraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ExactTime {
    pub(super) whole_part: i64,
    pub(super) fraction: f64,
}

/// Magnitude beyond which a double has no fraction, 2⁵³.
const NO_PART: f64 = 9_007_199_254_740_992.0;

impl From<f64> for ExactTime {
    fn from(value: f64) -> Self {
        if value.abs() < NO_PART {
            #[expect(clippy::cast_possible_truncation, reason = "below 2^53")]
            let integer = value as i64;
            return Self { whole_part: integer, fraction: value.fract() };
        }
        Self { whole_part: 0, fraction: value }
    }
}

impl ExactTime {
    /// Parses a number with a decimal point.
    pub(super) fn of_number(text: &str) -> Option<Self> {
        let value: f64 = text.parse().ok()?;
        let point = text.find('.').unwrap_or(text.len());
        let (digits, decimals) = text.split_at(point);
        let part = match decimals {
            "" | "." => Ok(0.0),
            decimals => decimals.parse::<f64>(),
        };
        match (digits.parse(), part) {
            (Ok(complete), Ok(part)) if part < 1.0 && !decimals.contains(['e', 'E']) => {
                Some(Self { whole_part: complete, fraction: part.copysign(value) })
            }
            _ => Some(value.into()),
        }
    }

    /// Returns its nanoseconds for a unit of this number of seconds.
    #[expect(clippy::cast_possible_truncation, reason = "saturates, and is no date then")]
    pub(super) fn to_nanoseconds(self, second: f64) -> i128 {
        // The unit has 1 to 1e9 nanoseconds.
        let unit_ns = (1e9 * second).round();
        i128::from(self.whole_part) * unit_ns as i128 + (self.fraction * unit_ns).round() as i128
    }

    /// Parses a date with its time of day (ISO 8601) to seconds after 1970. Without an offset, the
    /// clock is unknown.
    pub(super) fn of_date(text: &str) -> Option<Self> {
        let (date, offset_s) = without_offset(text)?;
        let time = humantime::parse_rfc3339_weak(date).ok()?;
        let since: Duration = time.duration_since(SystemTime::UNIX_EPOCH).ok()?;
        let seconds = i64::try_from(since.as_secs()).ok()? - offset_s;
        Some(Self { whole_part: seconds, fraction: 1e-9 * f64::from(since.subsec_nanos()) })
    }
}

/// Returns true if a date has an offset.
pub(super) fn names_its_clock(text: &str) -> bool {
    text.ends_with(['Z', 'z']) || text.get(TIME_OF_DAY..).is_some_and(|of| of.contains(['+', '-']))
}

/// Earliest position of an offset in a date.
const TIME_OF_DAY: usize = "2024-05-01T12:00:00".len();

/// Splits a date into the date without offset and the offset \[s\].
fn without_offset(text: &str) -> Option<(&str, i64)> {
    let text = text.strip_suffix(['Z', 'z']).unwrap_or(text);
    let behind = text.get(TIME_OF_DAY..)?;
    let Some(at) = behind.find(['+', '-']) else { return Some((text, 0)) };
    let (date, offset) = text.split_at(TIME_OF_DAY + at);
    let digits = offset[1..].replacen(':', "", 1);
    let is_offset = matches!(digits.len(), 2 | 4) && digits.bytes().all(|c| c.is_ascii_digit());
    let (hours, minutes) = digits.split_at_checked(2).filter(|_| is_offset)?;
    let minutes: i64 = if minutes.is_empty() { 0 } else { minutes.parse().ok()? };
    let seconds = 3600 * hours.parse::<i64>().ok()? + 60 * minutes;
    Some((date, if offset.starts_with('-') { -seconds } else { seconds }))
}

/// The first time, from which all others count.
#[derive(Default)]
pub(super) struct FirstTime(pub(super) Option<ExactTime>);

impl FirstTime {
    pub(super) fn seconds_after(&mut self, time: ExactTime) -> f64 {
        let first = *self.0.get_or_insert(time);
        #[expect(clippy::cast_precision_loss, reason = "differences")]
        let seconds = time.whole_part.saturating_sub(first.whole_part) as f64;
        seconds + (time.fraction - first.fraction)
    }
}

/// Returns the value of the last digit of a number or of a date's seconds.
pub(super) fn digit_resolution(text: &str) -> f64 {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let decimals = mantissa.split_once(['.', ',']).map_or("", |(_, decimals)| decimals);
    let decimals = decimals.bytes().take_while(u8::is_ascii_digit).count();
    let decimals = i32::try_from(decimals).unwrap_or(i32::MAX);
    exponent.parse::<i32>().map_or(0.0, |exponent| 10f64.powi(exponent.saturating_sub(decimals)))
}

/// An invalid part of a stamp: its row, its value, and the expected range.
pub(super) type NotFractional = (usize, f64, &'static str);

/// Returns the times of two-part stamps after the first one \[s\], and the first one. The error is
/// the first impossible value, with true if it is in the seconds.
pub(super) fn of_parts(
    sec: &[f64],
    nanosec: &[f64],
) -> Result<(Vec<f64>, Option<ExactTime>), (bool, NotFractional)> {
    let mut first = FirstTime::default();
    let stamps = sec.iter().zip(nanosec).enumerate().map(|(row, (sec, nanosec))| {
        if sec.fract() != 0.0 || sec.abs() >= NO_PART {
            return Err((true, (row, *sec, "a number of whole seconds")));
        }
        if nanosec.fract() != 0.0 || !(0.0..1e9).contains(nanosec) {
            let wanted = "a number of nanoseconds within a second, 0 to 999999999";
            return Err((false, (row, *nanosec, wanted)));
        }
        let ExactTime { whole_part: complete, .. } = (*sec).into();
        Ok(first.seconds_after(ExactTime { whole_part: complete, fraction: 1e-9 * nanosec }))
    });
    let times = stamps.collect::<Result<_, _>>()?;
    Ok((times, first.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// \[ns\] after 2024-05-01T12:00:00Z.
    fn nanoseconds(date: &str) -> Option<i64> {
        let ExactTime { whole_part: complete, fraction: part } = ExactTime::of_date(date)?;
        #[expect(clippy::cast_possible_truncation, reason = "within a second")]
        let part = (1e9 * part).round() as i64;
        Some((complete - 1_714_564_800) * 1_000_000_000 + part)
    }

    #[test]
    fn dates_are_instants_whatever_their_offset() {
        for (date, expected) in [
            ("2024-05-01T12:00:00Z", 0),
            ("2024-05-01 12:00:00", 0),
            ("2024-05-01T12:00:00.123456789Z", 123_456_789),
            ("2024-05-01T14:00:00.5+02:00", 500_000_000),
            ("2024-05-01T08:30:00-0330", 0),
            ("2024-05-01T11:00:00-01", 0),
            ("2024-04-30T12:00:00Z", -86_400_000_000_000),
            ("2024-02-29T12:00:00Z", -62 * 86_400_000_000_000),
        ] {
            assert_eq!(nanoseconds(date), Some(expected), "{date}");
        }
        for none in [
            "",
            "2024-05-01",
            "2024-13-01T12:00:00Z",
            "2023-02-29T12:00:00Z",
            "2024-05-01T25:00:00Z",
            "2024-05-01T12:00:00+2",
            "2024-05-01T12:00:00 CET",
            "2024-05-01T12:00:00+02:00:00",
            "2024-05-01T12:00:0é",
            "1714564800.5",
        ] {
            assert_eq!(ExactTime::of_date(none), None, "{none}");
        }
    }

    #[test]
    fn numbers_keep_every_digit_after_the_first() {
        let after = |first: &str, then: &str| {
            let mut first_time = FirstTime::default();
            let [_, after] = [first, then]
                .map(|text| first_time.seconds_after(ExactTime::of_number(text).unwrap()));
            after
        };
        for (first, then, expected) in [
            ("1714564800.123456789", "1714564801.123456790", 1.000_000_001),
            ("1714564800123456789", "1714564800123456790", 1.0),
            ("-0.5", "0.25", 0.75),
            ("-1.5", "-1.25", 0.25),
            ("0", "1.2e1", 12.0),
            ("5.", ".5", -4.5),
        ] {
            let difference = after(first, then);
            assert!(
                (difference - expected).abs() < 1e-15 * expected.abs().max(0.1),
                "{then}: {difference}"
            );
        }
        assert_eq!(ExactTime::of_number("1.5.2"), None);
    }
}
