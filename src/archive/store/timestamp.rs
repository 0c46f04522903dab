//! A wall-clock time in the format of RFC 3339.

use core::fmt;
use core::time::Duration;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use didim_formats::RecordingStart;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A wall-clock time with a resolution of one second, in UTC. The text format is RFC 3339:
/// `2026-11-22T07:17:29Z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Timestamp(u64);

/// The last second that RFC 3339 can represent: the end of the year 9999.
const LATEST_UNIX_S: u64 = 253_402_300_799;
/// Seconds of a day.
const DAY_S: u64 = 86_400;
/// 2020-01-01T00:00:00Z, which is before this program existed. A controller without a clock battery
/// starts in 1970 or at the date of its image, until its clock is set.
const CLOCK_IS_SET_UNIX_S: u64 = 1_577_836_800;

impl Timestamp {
    /// Returns the current time. If the clock is before 1970 or after 9999, returns the nearest
    /// representable time.
    pub fn now() -> Self {
        Self::from_unix_s(
            SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()),
        )
    }

    /// Returns the time at which a file was last written.
    ///
    /// # Errors
    /// The system does not give the time.
    pub fn of_file(path: &Path) -> std::io::Result<Self> {
        let written = std::fs::metadata(path)?.modified()?;
        let since = written.duration_since(UNIX_EPOCH).unwrap_or_default();
        Ok(Self::from_unix_s(since.as_secs()))
    }

    /// Returns the time this number of seconds after 1970-01-01T00:00:00Z.
    pub fn from_unix_s(seconds: u64) -> Self {
        Self(seconds.min(LATEST_UNIX_S))
    }

    /// Returns the seconds after 1970-01-01T00:00:00Z.
    pub fn unix_s(self) -> u64 {
        self.0
    }

    /// Returns the number of the day in UTC, counted from 1970-01-01.
    pub fn day(self) -> u64 {
        self.0 / DAY_S
    }

    /// Returns true if the time is plausible. Times before 2020 are from a clock that was not set.
    pub fn is_set(self) -> bool {
        self.0 >= CLOCK_IS_SET_UNIX_S
    }

    /// Returns the days from another time to this one. The number is negative if the other time is
    /// later.
    #[expect(clippy::cast_precision_loss, reason = "seconds until 9999 are below 2^53")]
    pub fn days_after(self, other: Self) -> f64 {
        (self.0 as f64 - other.0 as f64) / 86_400.0
    }

    /// Returns this time plus a number of days. `None` if the result is outside the representable
    /// years.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within the range just checked"
    )]
    pub fn plus_days(self, days: f64) -> Option<Self> {
        let seconds = self.0 as f64 + 86_400.0 * days;
        (0.0..=LATEST_UNIX_S as f64).contains(&seconds).then_some(Self(seconds as u64))
    }

    /// Returns the day alone: `2026-11-22`.
    pub fn date(self) -> String {
        self.to_string().chars().take(10).collect()
    }

    /// Returns day and time to the minute, for tables: `2026-11-22 07:17`.
    pub fn minute(self) -> String {
        self.to_string().chars().take(16).map(|c| if c == 'T' { ' ' } else { c }).collect()
    }

    fn system_time(self) -> SystemTime {
        UNIX_EPOCH + Duration::from_secs(self.0)
    }
}

impl From<RecordingStart> for Timestamp {
    fn from(start: RecordingStart) -> Self {
        Self::from_unix_s(start.unix_ms() / 1000)
    }
}

impl fmt::Display for Timestamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        humantime::format_rfc3339_seconds(self.system_time()).fmt(f)
    }
}

impl Serialize for Timestamp {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Timestamp {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let time = humantime::parse_rfc3339(&text).map_err(de::Error::custom)?;
        let since = time.duration_since(UNIX_EPOCH).map_err(de::Error::custom)?;
        Ok(Self::from_unix_s(since.as_secs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_text_of_rfc_3339_both_ways() {
        // date -u -d 2026-11-22T07:17:29Z +%s
        let time = Timestamp::from_unix_s(1_795_331_849);
        assert_eq!(serde_json::to_string(&time).unwrap(), "\"2026-11-22T07:17:29Z\"");
        assert_eq!(serde_json::from_str::<Timestamp>("\"2026-11-22T07:17:29Z\"").unwrap(), time);
        assert_eq!(
            (time.date().as_str(), time.minute().as_str()),
            ("2026-11-22", "2026-11-22 07:17")
        );
        let later = time.plus_days(1.5).unwrap();
        assert_eq!(later.to_string(), "2026-11-23T19:17:29Z");
        assert!((time.days_after(later) + 1.5).abs() < 1e-12);
        // date -u -d 2020-01-01 +%s
        assert!(time.is_set() && Timestamp::from_unix_s(1_577_836_800).is_set());
        assert!(!Timestamp::from_unix_s(1_577_836_799).is_set());
        assert_eq!(time.plus_days(1e9), None);
        assert_eq!(time.plus_days(f64::NAN), None);
        assert!(Timestamp::from_unix_s(u64::MAX).to_string().starts_with("9999-12-31"));
        for bad in ["\"yesterday\"", "3", "\"2026-13-01T00:00:00Z\"", "null"] {
            assert!(serde_json::from_str::<Timestamp>(bad).is_err(), "{bad}");
        }
    }
}
