//! Assignment of stamps to bus cycles.
//!
//! Stamps jitter by up to a good part of a period on a busy machine, and the bus has its own clock.
//! So cycles are counted on a grid that follows the stamps slowly. The grid is a straight line of
//! stamp over cycle number. The line is a least-squares fit at first; later it has a memory of
//! fixed length (an alpha-beta filter; Brookner, Tracking and Kalman Filtering Made Easy, section
//! 1.2). A stamp belongs to the nearest grid point.

use super::limits::AssemblyLimits;

/// Smallest share of a stamp's deviation that is added to the phase \[1\]. It averages jitter over
/// about ten cycles.
const PHASE_GAIN: f64 = 0.125;

/// Smallest share of a stamp's deviation that is added to the period \[1\]. It can be small because
/// the rate of a crystal changes only over minutes. It has to be small because the period bridges
/// gaps. With a jitter of a third of a period, the grid is off by a few thousandths of a period
/// after 100 lost cycles.
const PERIOD_GAIN: f64 = 1e-4;

/// Grid of bus cycles, positioned at the latest cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    limits: AssemblyLimits,
    nominal_ns: f64,
    period_ns: f64,
    /// Stamp of the latest cycle, and the position of its grid point relative to that stamp \[ns\].
    stamp_ns: u64,
    phase_ns: f64,
    /// Number of stamps since the start of the grid, at most 1,000. Both gains are constant before
    /// that.
    stamp_count: f64,
}

impl Grid {
    pub(super) fn start(limits: AssemblyLimits, nominal_ns: f64, stamp_ns: u64) -> Self {
        Self {
            limits,
            nominal_ns,
            period_ns: nominal_ns,
            stamp_ns,
            phase_ns: 0.0,
            stamp_count: 1.0,
        }
    }

    /// Returns the period measured from the stamps \[ns\].
    pub(super) fn period_ns(&self) -> f64 {
        self.period_ns
    }

    /// Returns the distance of a stamp from the latest grid point in periods, negative before that
    /// point.
    pub(super) fn periods_to(&self, stamp_ns: u64) -> f64 {
        (difference(stamp_ns, self.stamp_ns) - self.phase_ns) / self.period_ns
    }

    /// Returns true if `stamp_ns` is before the latest stamp.
    pub(super) fn is_before(&self, stamp_ns: u64) -> bool {
        stamp_ns < self.stamp_ns
    }

    /// Returns true if the silence between the latest stamp and `stamp_ns` ends the train of
    /// cycles.
    pub(super) fn is_silence(&self, stamp_ns: u64) -> bool {
        let (periods, least_ns) = self.limits.silence;
        difference(stamp_ns, self.stamp_ns) >= least_ns.max(periods * self.nominal_ns)
    }

    /// Moves the grid by `cycles` cycles and corrects it with the stamp of the new cycle.
    pub(super) fn advance(&mut self, stamp_ns: u64, cycles: u64) {
        let cycles = cycles.max(1) as f64;
        let deviation =
            difference(stamp_ns, self.stamp_ns) - self.phase_ns - cycles * self.period_ns;
        // Use the gains of a least-squares line through n points until they reach their minimum.
        self.stamp_count = (self.stamp_count + 1.0).min(1e3);
        let n = self.stamp_count;
        let phase_gain = (2.0 * (2.0 * n - 1.0) / (n * (n + 1.0))).clamp(PHASE_GAIN, 1.0);
        let period_gain = (6.0 / (n * (n + 1.0))).clamp(PERIOD_GAIN, 1.0);
        self.period_ns = (self.period_ns + period_gain * deviation / cycles).clamp(
            self.nominal_ns * (1.0 - self.limits.period_tolerance),
            self.nominal_ns * (1.0 + self.limits.period_tolerance),
        );
        self.phase_ns = (phase_gain - 1.0) * deviation;
        self.stamp_ns = stamp_ns;
    }
}

/// Returns `a − b` \[ns\]; exact up to 104 days.
pub(super) fn difference(a: u64, b: u64) -> f64 {
    let distance = a.abs_diff(b) as f64;
    if a >= b { distance } else { -distance }
}
