//! When an interface that vanished is looked for again.

use core::time::Duration;
use std::time::Instant;

/// Waits between attempts: doubled from the first to the last.
pub(super) const FIRST: Duration = Duration::from_millis(20);
const LAST: Duration = Duration::from_secs(2);

/// The next attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Retry {
    at: Instant,
    delay: Duration,
}

impl Retry {
    /// It vanished now.
    pub(super) fn first(now: Instant) -> Self {
        Self { at: now + FIRST, delay: FIRST }
    }

    /// An attempt failed now.
    #[must_use]
    pub(super) fn failed(self, now: Instant) -> Self {
        let delay = (2 * self.delay).min(LAST);
        Self { at: now + delay, delay }
    }

    /// How long until the next attempt: nothing when it is due.
    pub(super) fn left(&self, now: Instant) -> Duration {
        self.at.saturating_duration_since(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attempts_become_rare_and_never_end() {
        let start = Instant::now();
        let (mut now, mut retry, mut waits) = (start, Retry::first(start), Vec::new());
        // An hour without the interface.
        while now - start < Duration::from_secs(3_600) {
            waits.push(retry.left(now));
            now += retry.left(now);
            assert!(retry.left(now).is_zero() && retry.left(now + LAST).is_zero());
            retry = retry.failed(now);
        }
        let ms = |ms| Duration::from_millis(ms);
        let growing = [20, 40, 80, 160, 320, 640, 1280].map(ms);
        assert_eq!(waits[..7], growing);
        assert!(waits[7..].iter().all(|wait| *wait == LAST));
        assert_eq!(waits.len(), 1_806);
    }
}
