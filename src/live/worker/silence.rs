//! Whether a living bus has fallen silent, as the worker sees it: it may be in another process than
//! the bus thread.

use std::time::{Duration, Instant};

/// A bus without a sample for this long is silent: many times what a batch waits for.
const SILENT_AFTER: Duration = Duration::from_secs(1);

/// Tells each silence once.
#[derive(Debug, Default)]
pub(super) struct SilenceWatch {
    /// When the last sample came, unless the silence after it was told.
    last: Option<Instant>,
}

impl SilenceWatch {
    /// Samples came.
    pub(super) fn handle_samples(&mut self, now: Instant) {
        self.last = Some(now);
    }

    /// Whether a silence has begun that was not told yet.
    pub(super) fn is_new(&mut self, now: Instant) -> bool {
        let silent = |last: &mut Instant| now.saturating_duration_since(*last) >= SILENT_AFTER;
        self.last.take_if(silent).is_some()
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
        assert!(!watch.is_new(at(6999)));
        assert!(watch.is_new(at(7000)));
        assert!(!watch.is_new(at(9000)));
        watch.handle_samples(at(9500));
        assert!(watch.is_new(at(20_000)));
    }
}
