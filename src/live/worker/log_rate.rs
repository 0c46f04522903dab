//! A bound on what repeated causes write into the log.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How often a cause is logged.
const PERIOD: Duration = Duration::from_secs(60);

/// Of each cause the first is logged, then at most one a minute, which tells how many were not.
#[derive(Debug, Default)]
pub(super) struct LogRate(BTreeMap<&'static str, Cause>);

#[derive(Debug)]
struct Cause {
    logged: Instant,
    unlogged: u64,
}

impl LogRate {
    /// Whether to log now; if so, how many were not logged since the last time.
    pub(super) fn admit(&mut self, cause: &'static str, now: Instant) -> Option<u64> {
        let Some(known) = self.0.get_mut(cause) else {
            self.0.insert(cause, Cause { logged: now, unlogged: 0 });
            return Some(0);
        };
        if now.saturating_duration_since(known.logged) < PERIOD {
            known.unlogged += 1;
            return None;
        }
        known.logged = now;
        Some(std::mem::take(&mut known.unlogged))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_logged_once_a_minute_with_its_count() {
        let (mut rate, start) = (LogRate::default(), Instant::now());
        let at = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(rate.admit("busy", at(0)), Some(0));
        assert_eq!(rate.admit("too-short", at(1)), Some(0), "causes are separate");
        assert!((2..60).all(|second| rate.admit("busy", at(second)).is_none()));
        assert_eq!(rate.admit("busy", at(60)), Some(58));
        assert_eq!(rate.admit("busy", at(119)), None);
        assert_eq!(rate.admit("busy", at(120)), Some(1));
        assert_eq!(rate.admit("busy", at(300)), Some(0));
    }
}
