//! Rate limit for log messages of repeated causes.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Minimum time between two log messages of a cause.
const LOG_PERIOD: Duration = Duration::from_secs(60);

/// Rate limiter. The first message of each cause is logged. Further messages are logged at most
/// once a minute, with the number of skipped ones.
#[derive(Debug, Default)]
pub(super) struct LogRate(BTreeMap<&'static str, LoggedCause>);

#[derive(Debug)]
struct LoggedCause {
    last_logged: Instant,
    suppressed: u64,
}

impl LogRate {
    /// Decides whether a message is logged now. If so, returns the number of messages of this cause
    /// that were skipped since the last one. Otherwise returns `None`.
    pub(super) fn should_log(&mut self, cause: &'static str, now: Instant) -> Option<u64> {
        let Some(entry) = self.0.get_mut(cause) else {
            self.0.insert(cause, LoggedCause { last_logged: now, suppressed: 0 });
            return Some(0);
        };
        if now.saturating_duration_since(entry.last_logged) < LOG_PERIOD {
            entry.suppressed += 1;
            return None;
        }
        entry.last_logged = now;
        Some(std::mem::take(&mut entry.suppressed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_logged_once_a_minute_with_its_count() {
        let (mut rate, start) = (LogRate::default(), Instant::now());
        let time_at = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(rate.should_log("busy", time_at(0)), Some(0));
        assert_eq!(rate.should_log("too-short", time_at(1)), Some(0), "causes are separate");
        assert!((2..60).all(|second| rate.should_log("busy", time_at(second)).is_none()));
        assert_eq!(rate.should_log("busy", time_at(60)), Some(58));
        assert_eq!(rate.should_log("busy", time_at(119)), None);
        assert_eq!(rate.should_log("busy", time_at(120)), Some(1));
        assert_eq!(rate.should_log("busy", time_at(300)), Some(0));
    }
}
