//! Mapping of hardware and software stamps to one monotonic time.
//!
//! This module contains only state machines and reads no clock. The caller passes pairs of clock
//! readings to them (for a live bus from [`crate::socket::clock_pair`]). A log needs no mapping,
//! because its stamps are its own time.

mod hardware;
mod limits;

pub use hardware::HardwareClock;
use limits::ClockLimits;

/// Both system clocks at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockPair {
    /// CLOCK_REALTIME \[ns\].
    pub realtime_ns: u64,
    /// CLOCK_BOOTTIME \[ns\].
    pub monotonic_ns: u64,
    /// Largest possible time between the two readings \[ns\].
    pub uncertainty_ns: u64,
}

impl ClockPair {
    /// Returns monotonic minus realtime \[ns\].
    fn offset(&self) -> i128 {
        i128::from(self.monotonic_ns) - i128::from(self.realtime_ns)
    }
}

/// Result of a new pair of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockChange {
    /// The pair agrees with the present offset, within the sum of both uncertainties and one
    /// microsecond.
    None,
    /// The offset between the clocks changed a little. The new offset applies at once.
    Drift {
        /// Change of CLOCK_REALTIME relative to CLOCK_BOOTTIME \[ns\]; positive if it was put
        /// forward.
        by_ns: i64,
    },
    /// CLOCK_REALTIME was set.
    Step {
        /// Change of CLOCK_REALTIME relative to CLOCK_BOOTTIME \[ns\]; positive if it was put
        /// forward.
        by_ns: i64,
    },
}

/// Counters of a [`ClockMap`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockCounters {
    /// Number of times that CLOCK_REALTIME was set.
    pub steps: u64,
    /// The last step \[ns\]; positive if the clock was put forward.
    pub last_step_ns: i64,
    /// Number of small changes of the offset.
    pub small_changes: u64,
    /// Sum of the small changes \[ns\].
    pub drift_ns: i64,
    /// Number of stamps that would have gone backwards and were set to the previous stamp.
    pub held_back: u64,
    /// Number of stamps in the future that were set to the instant of the latest pair.
    pub future_stamps: u64,
}

const LIMITS: ClockLimits = ClockLimits::DEFAULT;

/// Maps CLOCK_REALTIME stamps to CLOCK_BOOTTIME, never backwards.
///
/// Read a new pair after each received batch, and pass it to [`Self::handle_pair`] before the batch
/// is mapped. Every stamp then lies before the pair. After a step, one batch may contain stamps
/// from before and from after the step. Each stamp is mapped with the offset that gives the later
/// time, if this time is not after the pair. The reason is that a stamp cannot be in the future and
/// is recent when it is read. A stamp of the earlier offset is not after the pair that showed the
/// step either, unless the step is so small that a hardware clock has not followed it yet.
#[derive(Clone, Debug)]
pub struct ClockMap {
    offset: i128,
    before_step: Option<BeforeStep>,
    /// Uncertainty of the pair that gave the offset \[ns\].
    uncertainty_ns: u64,
    /// Instant of the latest pair \[monotonic ns\].
    latest_ns: u64,
    /// Last stamp that was returned \[monotonic ns\].
    last_ns: u64,
    counters: ClockCounters,
}

/// The offset before the last step.
#[derive(Clone, Copy, Debug)]
struct BeforeStep {
    /// The offset \[ns\].
    offset: i128,
    /// Latest instant of a stamp with this offset \[monotonic ns\].
    last_stamp_ns: u64,
    /// Time until which such stamps may arrive \[monotonic ns\].
    until_ns: u64,
}

impl ClockMap {
    /// Creates a map from a first pair.
    pub fn new(pair: ClockPair) -> Self {
        Self {
            offset: pair.offset(),
            before_step: None,
            uncertainty_ns: pair.uncertainty_ns,
            latest_ns: pair.monotonic_ns,
            last_ns: 0,
            counters: ClockCounters::default(),
        }
    }

    /// Takes a later pair, and returns its difference from the present offset.
    pub fn handle_pair(&mut self, pair: ClockPair) -> ClockChange {
        let gained = self.offset - pair.offset();
        let noise =
            u128::from(pair.uncertainty_ns) + u128::from(self.uncertainty_ns) + LIMITS.noise_ns;
        if self.before_step.is_some_and(|before| pair.monotonic_ns > before.until_ns) {
            self.before_step = None;
        }
        self.latest_ns = pair.monotonic_ns;
        if gained.unsigned_abs() <= noise {
            return ClockChange::None;
        }
        let by_ns = i64::try_from(gained).unwrap_or(if gained < 0 { i64::MIN } else { i64::MAX });
        let before = core::mem::replace(&mut self.offset, pair.offset());
        self.uncertainty_ns = pair.uncertainty_ns;
        if gained.unsigned_abs() < u128::from(LIMITS.step_ns) {
            self.counters.small_changes += 1;
            self.counters.drift_ns = self.counters.drift_ns.saturating_add(by_ns);
            return ClockChange::Drift { by_ns };
        }
        let until_ns = pair.monotonic_ns.saturating_add(LIMITS.step_memory_ns());
        let is_followed = gained.unsigned_abs() >= LIMITS.hardware_step_ns.unsigned_abs();
        let last_stamp_ns = if is_followed { pair.monotonic_ns } else { until_ns };
        self.before_step = Some(BeforeStep { offset: before, last_stamp_ns, until_ns });
        self.counters.steps += 1;
        self.counters.last_step_ns = by_ns;
        ClockChange::Step { by_ns }
    }

    /// Returns the monotonic instant of a CLOCK_REALTIME stamp \[ns\]. It is never before the
    /// instant that the previous call returned.
    pub fn map(&mut self, realtime_ns: u64) -> u64 {
        let latest = i128::from(self.latest_ns);
        let shifted = |offset: i128| i128::from(realtime_ns) + offset;
        let now = shifted(self.offset);
        let mapped = match self.before_step {
            Some(BeforeStep { offset, last_stamp_ns, .. }) => {
                let earlier = (shifted(offset), latest.min(last_stamp_ns.into()));
                let valid = [(now, latest), earlier].into_iter().filter(|(at, last)| at <= last);
                valid.map(|(at, _)| at).max()
            }
            None => (now <= latest).then_some(now),
        };
        let mapped = mapped.unwrap_or_else(|| {
            self.counters.future_stamps += 1;
            latest
        });
        let mapped = u64::try_from(mapped).unwrap_or(0);
        if mapped < self.last_ns {
            self.counters.held_back += 1;
        }
        self.last_ns = mapped.max(self.last_ns);
        self.last_ns
    }

    /// Returns the counters of this map.
    pub fn counters(&self) -> ClockCounters {
        self.counters
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;
    const START: u64 = 1_700_000_000_000 * MS;

    fn pair(realtime_ns: u64, monotonic_ns: u64) -> ClockPair {
        ClockPair { realtime_ns, monotonic_ns, uncertainty_ns: 100 }
    }

    #[test]
    fn stamps_are_shifted_exactly_while_the_clocks_agree() {
        let mut map = ClockMap::new(pair(START, 5 * MS));
        assert_eq!(map.handle_pair(pair(START + 10 * MS + 150, 15 * MS)), ClockChange::None);
        assert_eq!(map.map(START + 2 * MS + 1), 7 * MS + 1);
        assert_eq!(map.map(START + 2 * MS + 2), 7 * MS + 2);
        assert_eq!(map.counters(), ClockCounters::default());
    }

    #[test]
    fn noise_does_not_add_up_but_drift_is_followed() {
        let mut map = ClockMap::new(pair(START, 0));
        for n in 1..100 {
            assert_eq!(map.handle_pair(pair(START + n * MS + 150, n * MS)), ClockChange::None);
        }
        let drifted = pair(START + 100 * MS + 5_000, 100 * MS);
        assert_eq!(map.handle_pair(drifted), ClockChange::Drift { by_ns: 5_000 });
        assert_eq!(map.map(START + 99 * MS + 5_000), 99 * MS);
        assert_eq!((map.counters().small_changes, map.counters().drift_ns), (1, 5_000));
    }

    /// A bus at 1 kHz, read every 10 ms, with the clock set in the middle of a batch.
    fn across_a_step(by_ns: i64) {
        let shift = |n: u64| if n >= 105 { by_ns } else { 0 };
        let realtime = |n: u64| (START + n * MS).strict_add_signed(shift(n));
        let mut map = ClockMap::new(pair(START, 0));
        for batch in 0..30 {
            let end = (batch + 1) * 10;
            map.handle_pair(pair(realtime(end), end * MS));
            for n in batch * 10..end {
                assert_eq!(map.map(realtime(n)), n * MS, "step {by_ns}, frame {n}");
            }
        }
        assert_eq!((map.counters().steps, map.counters().last_step_ns), (1, by_ns));
        assert_eq!((map.counters().held_back, map.counters().future_stamps), (0, 0));
    }

    #[test]
    fn a_step_inside_a_batch_moves_no_stamp() {
        for seconds in [1, 3_600, 86_400] {
            across_a_step(seconds * 1_000_000_000);
            across_a_step(-seconds * 1_000_000_000);
        }
        across_a_step(20 * 1_000_000);
        across_a_step(-20 * 1_000_000);
    }

    /// Frames that are read later than the step is large do not belong to the clock before it.
    #[test]
    fn a_late_read_after_a_step_moves_no_stamp() {
        let by_ns = 22_000_000;
        let mut map = ClockMap::new(pair(START, 0));
        let shifted = |n: u64| START + n * MS + by_ns;
        map.handle_pair(pair(shifted(10), 10 * MS));
        assert_eq!((map.map(START + 9 * MS), map.map(shifted(10))), (9 * MS, 10 * MS));
        map.handle_pair(pair(shifted(50), 50 * MS));
        for n in 11..50 {
            assert_eq!(map.map(shifted(n)), n * MS, "frame {n}");
        }
        assert_eq!((map.counters().steps, map.counters().held_back), (1, 0));
    }

    /// A step too small for the hardware clock to detect at once: it continues with the earlier
    /// clock.
    #[test]
    fn a_small_step_moves_no_hardware_stamp() {
        for by_ns in [15_000_000, -15_000_000] {
            let realtime =
                |n: u64| (START + n * MS).strict_add_signed(if n >= 2_505 { by_ns } else { 0 });
            let (mut hardware, mut map) = (HardwareClock::default(), ClockMap::new(pair(START, 0)));
            for batch in 0..2_000 {
                let end = (batch + 1) * 5;
                map.handle_pair(pair(realtime(end), end * MS));
                for n in batch * 5..end {
                    let stamp = hardware.realtime_ns(77 + n * MS, realtime(n) + 10_000);
                    let error = map.map(stamp).abs_diff(n * MS);
                    assert!(error <= 10_000, "step {by_ns}, frame {n}: {error}");
                }
            }
            assert_eq!((map.counters().steps, map.counters().last_step_ns), (1, by_ns));
        }
    }

    #[test]
    fn nothing_goes_backwards_or_into_the_future() {
        let mut map = ClockMap::new(pair(START, 100 * MS));
        map.handle_pair(pair(START + 10 * MS, 110 * MS));
        assert_eq!(map.map(START + 5 * MS), 105 * MS);
        assert_eq!(map.map(START + 4 * MS), 105 * MS);
        assert_eq!(map.map(START + 99 * MS), 110 * MS);
        assert_eq!((map.counters().held_back, map.counters().future_stamps), (1, 1));
    }

    proptest! {
        #[test]
        fn no_clocks_make_it_panic_or_go_backwards(
            readings in prop::collection::vec(
                (any::<u64>(), any::<u64>(), any::<u64>(), any::<u64>()),
                1..20,
            ),
        ) {
            let mut map = ClockMap::new(pair(readings[0].0, readings[0].1));
            let mut last = 0;
            for (realtime_ns, monotonic_ns, uncertainty_ns, stamp) in readings {
                map.handle_pair(ClockPair { realtime_ns, monotonic_ns, uncertainty_ns });
                let mapped = map.map(stamp);
                prop_assert!(mapped >= last);
                last = mapped;
            }
        }
    }
}
