//! Readiness of the service, and the progress of its threads.

use core::time::Duration;

use didim_drivers::socket::monotonic_ns;

use super::Parts;
use crate::live::acquire::{BusState, SharedAcquisition};
use crate::live::worker::SharedEstimation;

/// Time after which the service counts as ready although the frames give no samples. The layout may
/// be wrong, which the health reports. A service that never became ready would be ended before
/// anybody could query it.
const READY_TIMEOUT: Duration = Duration::from_secs(10);
/// Time without samples after which a process without a bus is ready. The process with the bus may
/// be started later.
const WITHOUT_SAMPLES: Duration = Duration::from_millis(500);

/// Counts of this process's threads that show their progress.
#[derive(Clone, Debug)]
pub(super) struct Progress {
    acquisition: Option<SharedAcquisition>,
    estimation: Option<SharedEstimation>,
    /// Time without a frame after which a bus is silent.
    silence_after: Duration,
    /// Iterations of the threads at the last check.
    iterations: (u64, u64),
}

impl Progress {
    pub(super) fn new(
        parts: &Parts,
        acquisition: Option<SharedAcquisition>,
        estimation: Option<SharedEstimation>,
    ) -> Self {
        let silence_after = match parts {
            Parts::Both(part, _) | Parts::Acquisition(part) => part.options.silence_after,
            Parts::Estimation(_) => WITHOUT_SAMPLES,
        };
        Self { acquisition, estimation, silence_after, iterations: (0, 0) }
    }

    /// Returns true if samples arrive, no drive is enabled, or the bus is known to be silent.
    /// `waited` is the time since the start of the threads.
    pub(super) fn is_ready(&self, waited: Duration) -> bool {
        if waited >= READY_TIMEOUT {
            return true;
        }
        if let Some(acquisition) = &self.acquisition {
            let counts = acquisition.counts();
            return match counts.bus {
                BusState::Waiting => waited >= self.silence_after,
                BusState::Ok => counts.losses.samples > 0 || counts.losses.cycles_idle > 0,
                BusState::Silent | BusState::Down | BusState::Ended => true,
            };
        }
        let samples = self.estimation.as_ref().map_or(0, |shared| shared.samples());
        samples > 0 || waited >= self.silence_after
    }

    /// Returns true if every thread has made progress since the last call that returned true. The
    /// threads also make progress on a silent bus and during an identification. The watchdog
    /// depends only on this. A restart helps if a thread hangs, but does not help against losses on
    /// the bus, which the health reports.
    pub(super) fn has_progressed(&mut self) -> bool {
        self.has_progressed_until(monotonic_ns())
    }

    /// Returns the same at the time `now_ns` \[ns, CLOCK_BOOTTIME\].
    fn has_progressed_until(&mut self, now_ns: u64) -> bool {
        let iterations = (
            self.acquisition.as_ref().map_or(0, |shared| shared.counts().iterations),
            self.estimation.as_ref().map_or(0, SharedEstimation::iterations),
        );
        // The thread that identifies gives a sign of life even while it computes.
        let is_stuck = |shared: &SharedEstimation| shared.is_identification_stuck(now_ns);
        if self.estimation.as_ref().is_some_and(is_stuck) {
            return false;
        }
        let acquired = self.acquisition.is_none() || iterations.0 != self.iterations.0;
        let estimated = self.estimation.is_none() || iterations.1 != self.iterations.1;
        if acquired && estimated {
            self.iterations = iterations;
        }
        acquired && estimated
    }

    /// Handles the normal end of the bus thread. It no longer has to make progress.
    pub(super) fn acquisition_ended(&mut self) {
        self.acquisition = None;
    }

    /// Handles the normal end of the worker. It no longer has to make progress.
    pub(super) fn estimation_ended(&mut self) {
        self.estimation = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::acquire::AcquisitionCounts;

    const SECOND: Duration = Duration::from_secs(1);

    fn progress(acquisition: bool, estimation: bool) -> Progress {
        Progress {
            acquisition: acquisition.then(SharedAcquisition::default),
            estimation: estimation.then(SharedEstimation::default),
            silence_after: SECOND,
            iterations: (0, 0),
        }
    }

    fn turn(progress: &Progress, bus: bool, worker: bool) {
        if let Some(shared) = progress.acquisition.as_ref().filter(|_| bus) {
            let counts = shared.counts();
            shared.publish(&AcquisitionCounts { iterations: counts.iterations + 50, ..counts });
        }
        if let Some(shared) = progress.estimation.as_ref().filter(|_| worker) {
            shared.count_iteration();
        }
    }

    #[test]
    fn the_watchdog_is_fed_while_both_turn_and_not_a_time_longer() {
        let mut progress = progress(true, true);
        // A year, checked every ten seconds.
        for _ in 0..365 * 8_640 {
            turn(&progress, true, true);
            assert!(progress.has_progressed());
        }
        for (bus, worker) in [(false, true), (true, false), (false, false)] {
            for _ in 0..1_000 {
                turn(&progress, bus, worker);
                // Progress of one of them since the last check counts for the next check.
                assert!(!progress.has_progressed() || (bus && worker));
            }
            turn(&progress, true, true);
            assert!(progress.has_progressed() && !progress.has_progressed());
        }
        // A thread that has ended normally is not waited for.
        progress.acquisition_ended();
        turn(&progress, false, true);
        assert!(progress.has_progressed() && !progress.has_progressed());
        progress.estimation_ended();
        assert!(progress.has_progressed());
    }

    #[test]
    fn an_identification_without_a_sign_of_life_starves_the_watchdog() {
        let shared = SharedEstimation::default();
        let later = |seconds: u64| monotonic_ns() + seconds * 1_000_000_000;
        assert!(!shared.is_identification_stuck(later(1_000)), "before its first one");
        shared.count_identification();
        assert!(!shared.is_identification_stuck(later(60)));
        assert!(shared.is_identification_stuck(later(180)));
        let mut progress = progress(false, true);
        for (seconds, fed) in [(60, true), (180, false)] {
            progress.estimation.as_ref().unwrap().count_identification();
            turn(&progress, false, true);
            assert_eq!(progress.has_progressed_until(later(seconds)), fed, "{seconds} s");
        }
    }

    #[test]
    fn it_is_ready_when_the_bus_is_known_and_after_ten_seconds_in_any_case() {
        let ready_after = |counts: AcquisitionCounts| {
            let progress = progress(true, true);
            progress.acquisition.as_ref().unwrap().publish(&counts);
            (0..=200).map(|n| n * SECOND / 10).find(|waited| progress.is_ready(*waited)).unwrap()
        };
        let counts_of = |bus| AcquisitionCounts { bus, ..AcquisitionCounts::default() };
        assert_eq!(ready_after(counts_of(BusState::Waiting)), SECOND);
        for bus in [BusState::Silent, BusState::Down, BusState::Ended] {
            assert_eq!(ready_after(counts_of(bus)), Duration::ZERO);
        }
        let mut frames = counts_of(BusState::Ok);
        assert_eq!(ready_after(frames), 10 * SECOND, "frames without a sample");
        frames.losses.cycles_idle = 1;
        assert_eq!(ready_after(frames), Duration::ZERO);
        let alone = progress(false, true);
        assert!(!alone.is_ready(SECOND / 2) && alone.is_ready(SECOND));
    }
}
