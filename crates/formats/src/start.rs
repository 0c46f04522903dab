//! When a recording began, by its own stamps.

use core::fmt;
use core::time::Duration;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// When a recording began, by its own stamps, rounded to a millisecond, in UTC. As text it is that
/// of RFC 3339: `2026-11-22T07:17:29.250Z`.
///
/// Half a millisecond is a whole number of microseconds: stamps that a log cut to these round to
/// the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RecordingStart {
    unix_ms: u64,
}

/// 2000-01-01T00:00:00Z. Earlier times count from the start of a machine or of a recording, or come
/// from a clock that nobody has set.
const FIRST_MS: i128 = 946_684_800_000;
/// The end of the year 9999: later instants have no text.
const LAST_MS: i128 = 253_402_300_799_999;

impl RecordingStart {
    /// Creates the start from a stamp in nanoseconds after 1970-01-01T00:00:00Z; `None` if it is
    /// not plausible.
    pub fn of_unix_ns(stamp_ns: i128) -> Option<Self> {
        let ms = (stamp_ns + 500_000).div_euclid(1_000_000);
        let unix_ms = u64::try_from(ms).ok()?;
        (FIRST_MS..=LAST_MS).contains(&ms).then_some(Self { unix_ms })
    }

    /// Returns the milliseconds after 1970-01-01T00:00:00Z.
    pub fn unix_ms(self) -> u64 {
        self.unix_ms
    }

    /// Formats the start: `2026-11-22 07:17:29.250 UTC`, or that it is not known.
    pub fn display_text(start: Option<Self>) -> String {
        let text = |start: Self| start.to_string().replace('T', " ").replace('Z', " UTC");
        start.map_or_else(|| "not known".to_owned(), text)
    }

    /// Formats the start for tables, to the minute: `2026-11-22 07:17`, or that it is not known.
    pub fn minute(start: Option<Self>) -> String {
        Self::display_text(start).chars().take("2026-11-22 07:17".len()).collect()
    }

    fn system_time(self) -> SystemTime {
        UNIX_EPOCH + Duration::from_millis(self.unix_ms)
    }
}

impl fmt::Display for RecordingStart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        humantime::format_rfc3339_millis(self.system_time()).fmt(f)
    }
}

impl Serialize for RecordingStart {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for RecordingStart {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(de::Error::custom)
    }
}

impl core::str::FromStr for RecordingStart {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let time = humantime::parse_rfc3339(text).ok();
        let since = time.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let ns = since.and_then(|since| i128::try_from(since.as_nanos()).ok());
        ns.and_then(Self::of_unix_ns).ok_or("no instant after 2000 in the form of RFC 3339")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_a_millisecond_whatever_digits_a_log_cut_off() {
        // date -u -d 2026-11-22T07:17:29Z +%s
        let second_ns = 1_795_331_849_000_000_000;
        for (ns, text) in [
            (0, "2026-11-22T07:17:29.000Z"),
            (499_999, "2026-11-22T07:17:29.000Z"),
            (500_000, "2026-11-22T07:17:29.001Z"),
            (250_499_999, "2026-11-22T07:17:29.250Z"),
            (250_500_000, "2026-11-22T07:17:29.251Z"),
        ] {
            let start = RecordingStart::of_unix_ns(second_ns + ns).unwrap();
            assert_eq!(start.to_string(), text);
            assert_eq!(RecordingStart::of_unix_ns(second_ns + ns / 1000 * 1000), Some(start));
            assert_eq!(text.parse(), Ok(start));
        }
        let start = RecordingStart::of_unix_ns(second_ns + 250_000_000);
        assert_eq!(RecordingStart::display_text(start), "2026-11-22 07:17:29.250 UTC");
        assert_eq!(RecordingStart::minute(start), "2026-11-22 07:17");
    }

    #[test]
    fn what_counts_from_another_place_is_no_date() {
        for ns in [i128::MIN / 2, -1, 0, 86_400_000_000_000, 946_684_799_000_000_000, i128::MAX / 2]
        {
            assert_eq!(RecordingStart::of_unix_ns(ns), None, "{ns}");
        }
        assert!(RecordingStart::of_unix_ns(946_684_800_000_000_000).is_some());
        assert_eq!(RecordingStart::display_text(None), "not known");
        assert_eq!(RecordingStart::minute(None), "not known");
        for bad in ["yesterday", "1970-01-01T00:00:00Z", "2026-13-01T00:00:00Z"] {
            assert!(bad.parse::<RecordingStart>().is_err(), "{bad}");
        }
    }
}
