//! Comparison of the bus period with the nominal period of the layout.
//!
//! The grid follows a bus whose period differs from the nominal one by up to 1 %; the phase of the
//! grid takes the deviation. Beyond 1 % the cycles cannot be counted. So this module compares the
//! measured period with the nominal one over seconds. Parameters need a far more exact rate; the
//! identification checks the rate of each window.
//!
//! A frame may be late, but it is never early. So only the least late stamp of each stretch counts.
//! A burst of late frames has no effect, but a wrong period shifts the stamps of every stretch.

use super::grid::difference;
use super::limits::AssemblyLimits;

/// Comparison of the stamps with the nominal period.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeriodWatch {
    limits: AssemblyLimits,
    nominal_ns: f64,
    stamp_ns: Option<u64>,
    /// Latest interval of about one period \[ns\]. It counts only if the next interval is about one
    /// period, too.
    held_ns: Option<f64>,
    /// True if the interval before the latest one was about one period.
    was_regular: bool,
    /// Number of cycles in the present stretch.
    cycles: f64,
    /// Delay of the latest stamp, compared with the number of cycles times the nominal period
    /// \[ns\].
    late_ns: f64,
    /// Minimum of `late_ns` in the present stretch \[ns\].
    least_ns: f64,
    /// True if `late_ns` counts from the least late stamp of the previous stretch.
    has_reference: bool,
    /// Number of consecutive stretches with too long a period; negative if the period was too
    /// short.
    deviating_stretches: i32,
}

impl PeriodWatch {
    pub(super) fn new(limits: AssemblyLimits, nominal_ns: f64) -> Self {
        Self {
            limits,
            nominal_ns,
            stamp_ns: None,
            held_ns: None,
            was_regular: false,
            cycles: 0.0,
            late_ns: 0.0,
            least_ns: f64::INFINITY,
            has_reference: false,
            deviating_stretches: 0,
        }
    }

    /// Returns true if the measured period is not the nominal one.
    pub(super) fn is_wrong(&self) -> bool {
        self.deviating_stretches.abs() >= self.limits.deviating_stretches
    }

    /// Takes a stamp that is `cycles` cycles after the previous one, as counted by the frames.
    pub(super) fn count(&mut self, stamp_ns: u64, cycles: u64) {
        if let Some(before) = self.stamp_ns.replace(stamp_ns) {
            self.add(difference(stamp_ns, before), cycles as f64);
        }
    }

    /// Takes a stamp whose counter has restarted. The number of cycles before it is unknown.
    pub(super) fn start(&mut self, stamp_ns: u64) {
        *self = Self {
            deviating_stretches: self.deviating_stretches,
            stamp_ns: Some(stamp_ns),
            ..Self::new(self.limits, self.nominal_ns)
        };
    }

    /// Takes a stamp without a counter. An interval counts only if it and both its neighbours are
    /// about one period long: an interval next to a late or a lost frame is meaningless.
    pub(super) fn handle_stamp(&mut self, stamp_ns: u64) {
        let Some(before) = self.stamp_ns.replace(stamp_ns) else { return };
        let interval_ns = difference(stamp_ns, before);
        let held_ns = self.held_ns.take();
        let regular = (interval_ns / self.nominal_ns - 1.0).abs() <= self.limits.interval_tolerance;
        if regular {
            if let Some(held_ns) = held_ns {
                self.add(held_ns, 1.0);
            }
            self.held_ns = self.was_regular.then_some(interval_ns);
        }
        self.was_regular = regular;
    }

    fn add(&mut self, interval_ns: f64, cycles: f64) {
        self.cycles += cycles;
        self.late_ns += interval_ns - cycles * self.nominal_ns;
        self.least_ns = self.least_ns.min(self.late_ns);
        let length_ns = self.cycles * self.nominal_ns;
        let (cycles, least_ns) = self.limits.stretch;
        if self.cycles < cycles || length_ns < least_ns {
            return;
        }
        // Count delays from the least late stamp on, so that their sum stays small and exact for
        // years.
        let least_ns = std::mem::replace(&mut self.least_ns, f64::INFINITY);
        self.cycles = 0.0;
        self.late_ns -= least_ns;
        if std::mem::replace(&mut self.has_reference, true) {
            let (gained, tolerance) = (least_ns / length_ns, self.limits.period_tolerance);
            self.deviating_stretches = if gained > tolerance {
                self.deviating_stretches.max(0).saturating_add(1)
            } else if gained < -tolerance {
                self.deviating_stretches.min(0).saturating_sub(1)
            } else {
                0
            };
        }
    }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, reason = "stamps of seconds fit")]
mod tests {
    use super::*;

    const NOMINAL_NS: f64 = 4e6;

    /// Simulates twenty seconds of a period that is `ratio` × nominal; each frame is
    /// `late_ns(cycle)` late.
    fn is_wrong(ratio: f64, counter: bool, late_ns: impl Fn(u64) -> u64) -> bool {
        let mut watch = PeriodWatch::new(AssemblyLimits::DEFAULT, NOMINAL_NS);
        let mut ever = false;
        for k in 0..5_000_u64 {
            let stamp_ns = (k as f64 * ratio * NOMINAL_NS) as u64 + late_ns(k);
            if counter {
                watch.count(stamp_ns, 1);
            } else {
                watch.handle_stamp(stamp_ns);
            }
            ever |= watch.is_wrong();
        }
        ever
    }

    /// Every `every` cycles, all frames of `cycles` cycles arrive together with the last of them.
    fn burst(every: u64, cycles: u64) -> impl Fn(u64) -> u64 {
        move |k| (cycles.saturating_sub(1 + k % every)) * 4_000_000
    }

    #[test]
    fn a_wrong_period_shows_and_late_frames_do_not() {
        for counter in [true, false] {
            for ratio in [0.75, 0.8, 0.95, 0.98, 1.02, 1.05, 1.25] {
                assert!(is_wrong(ratio, counter, |_| 0), "{ratio} {counter}");
                assert!(is_wrong(ratio, counter, burst(100, 25)), "{ratio} {counter}, bursts");
            }
            for ratio in [0.995, 1.0, 1.005] {
                assert!(!is_wrong(ratio, counter, |_| 0), "{ratio} {counter}");
                // 100 ms late every 0.4 s, 200 ms every 2 s, 1 s every 3 s, and permanently late by
                // 0.7 s.
                for (every, cycles) in [(100, 25), (500, 50), (750, 250)] {
                    assert!(!is_wrong(ratio, counter, burst(every, cycles)), "{ratio} {cycles}");
                }
                let later = |k| if k < 2_500 { 0 } else { 700_000_000 };
                assert!(!is_wrong(ratio, counter, later), "{ratio} {counter}");
                let random = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) % 1_300_000;
                assert!(!is_wrong(ratio, counter, random), "{ratio} {counter}");
            }
        }
        assert!(is_wrong(2.0, true, |_| 0));
        assert!(is_wrong(0.5, true, |_| 0));
    }

    #[test]
    fn a_period_that_is_right_again_is_right() {
        let mut watch = PeriodWatch::new(AssemblyLimits::DEFAULT, NOMINAL_NS);
        let mut stamp_ns = 0;
        for (period_ns, wrong) in [(4_400_000, true), (4_000_000, false), (3_600_000, true)] {
            for _ in 0..2_500 {
                stamp_ns += period_ns;
                watch.count(stamp_ns, 1);
            }
            assert_eq!(watch.is_wrong(), wrong, "{period_ns}");
        }
    }
}
