//! Whether a living bus has fallen silent, as the worker sees it: it may be in another process than
//! the bus thread.

use std::time::{Duration, Instant};

/// A bus without a sample for this long is silent: many times what a batch waits for.
const SILENT_AFTER: Duration = Duration::from_secs(1);

/// Tells each silence once.
#[derive(Debug, Default)]
pub(super) struct SilenceWatch {
    /// When the last sample came.
    last: Option<Instant>,
    /// None has come for long, which was told.
    is_silent: bool,
}

impl SilenceWatch {
    /// Samples came.
    pub(super) fn handle_samples(&mut self, now: Instant) {
        (self.last, self.is_silent) = (Some(now), false);
    }

    /// Whether a silence has begun that was not told yet.
    pub(super) fn is_new(&mut self, now: Instant) -> bool {
        let silent = |last: Instant| now.saturating_duration_since(last) >= SILENT_AFTER;
        let is_new = !self.is_silent && self.last.is_some_and(silent);
        self.is_silent |= is_new;
        is_new
    }

    /// Whether a silence was told that has not ended.
    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_silence_is_told_once() {
        let (mut watch, start) = (SilenceWatch::default(), Instant::now());
        let at = |ms| start + Duration::from_millis(ms);
        assert!(!watch.is_new(at(5000)), "before the first sample nothing is missing");
        watch.handle_samples(at(6000));
        assert!(!watch.is_new(at(6999)) && !watch.is_silent());
        assert!(watch.is_new(at(7000)) && watch.is_silent());
        assert!(!watch.is_new(at(9000)) && watch.is_silent());
        watch.handle_samples(at(9500));
        assert!(!watch.is_silent());
        assert!(watch.is_new(at(20_000)));
    }
}
