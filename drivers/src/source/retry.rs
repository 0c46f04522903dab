//! Schedule of the attempts to reopen a vanished interface.

use core::time::Duration;
use std::time::Instant;

/// First and longest time between two attempts. The time doubles after each attempt.
pub(super) const FIRST_DELAY: Duration = Duration::from_millis(20);
const LONGEST_DELAY: Duration = Duration::from_secs(2);

/// Time of the next attempt to open an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Retry {
    due: Instant,
    delay: Duration,
}

impl Retry {
    /// Schedules the first attempt after the interface vanished at `now`.
    pub(super) fn after_loss(now: Instant) -> Self {
        Self { due: now + FIRST_DELAY, delay: FIRST_DELAY }
    }

    /// Schedules the next attempt after a failure at `now`.
    #[must_use]
    pub(super) fn after_failure(self, now: Instant) -> Self {
        let delay = (2 * self.delay).min(LONGEST_DELAY);
        Self { due: now + delay, delay }
    }

    /// Returns the time until the next attempt; it is zero when the attempt is due.
    pub(super) fn remaining(&self, now: Instant) -> Duration {
        self.due.saturating_duration_since(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attempts_become_rare_and_never_end() {
        let start = Instant::now();
        let (mut now, mut retry, mut waits) = (start, Retry::after_loss(start), Vec::new());
        // An hour without the interface.
        while now - start < Duration::from_secs(3_600) {
            waits.push(retry.remaining(now));
            now += retry.remaining(now);
            assert!(
                retry.remaining(now).is_zero() && retry.remaining(now + LONGEST_DELAY).is_zero()
            );
            retry = retry.after_failure(now);
        }
        let ms = |ms| Duration::from_millis(ms);
        let growing = [20, 40, 80, 160, 320, 640, 1280].map(ms);
        assert_eq!(waits[..7], growing);
        assert!(waits[7..].iter().all(|wait| *wait == LONGEST_DELAY));
        assert_eq!(waits.len(), 1_806);
    }
}
