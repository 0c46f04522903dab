//! Detection of a silent live bus in the worker, which may be in another process than the bus
//! thread.

use crate::live::limits::LiveLimits;
use std::time::Instant;

/// Detector of silences. It reports each silence once.
#[derive(Debug, Default)]
pub(super) struct SilenceWatch {
    /// Arrival time of the last sample.
    last_arrival: Option<Instant>,
    /// True if a silence was reported and has not ended.
    is_silent: bool,
}

impl SilenceWatch {
    /// Records the arrival of samples.
    pub(super) fn handle_samples(&mut self, now: Instant) {
        (self.last_arrival, self.is_silent) = (Some(now), false);
    }

    /// Returns true if a silence has begun that has not been reported yet.
    pub(super) fn is_new(&mut self, now: Instant) -> bool {
        let silent =
            |last: Instant| now.saturating_duration_since(last) >= LiveLimits::DEFAULT.silent_after;
        let is_new = !self.is_silent && self.last_arrival.is_some_and(silent);
        self.is_silent |= is_new;
        is_new
    }

    /// Returns true if a reported silence has not ended.
    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn each_silence_is_reported_once() {
        let (mut watch, start) = (SilenceWatch::default(), Instant::now());
        let time_at = |ms| start + Duration::from_millis(ms);
        assert!(!watch.is_new(time_at(5000)), "before the first sample nothing is missing");
        watch.handle_samples(time_at(6000));
        assert!(!watch.is_new(time_at(6999)) && !watch.is_silent());
        assert!(watch.is_new(time_at(7000)) && watch.is_silent());
        assert!(!watch.is_new(time_at(9000)) && watch.is_silent());
        watch.handle_samples(time_at(9500));
        assert!(!watch.is_silent());
        assert!(watch.is_new(time_at(20_000)));
    }
}
