//! Limits of the assembly.

/// Limits that decide about frames and cycles.
///
/// They follow from the jitter of ordinary operating systems, not from any robot. A cell cannot
/// change them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssemblyLimits {
    /// Largest relative deviation from the nominal period at which cycles are counted \[1\]. A
    /// controller on an ordinary operating system stays within it; a larger deviation means that
    /// the bus is configured for another period. Convention: 0.01.
    pub period_tolerance: f64,
    /// Smallest silence that ends a train of cycles, in nominal periods and in time \[ns\]; the
    /// longer of the two applies. The next stamp after it starts a new train. Convention: 10
    /// periods and 1 s.
    pub silence: (f64, f64),
    /// Shortest stretch whose period is compared with the nominal one, in cycles and in time
    /// \[ns\]; the longer of the two applies. Convention: 100 cycles and 1 s.
    pub stretch: (f64, f64),
    /// Number of consecutive stretches that have to deviate in the same direction before the period
    /// counts as wrong. Derived: frames that become permanently late, or punctual again, shift only
    /// one stretch.
    pub deviating_stretches: i32,
    /// Largest deviation of an interval from one period, in periods, at which the interval counts.
    /// It applies to frames without a counter. Derived: beyond half a period, a lost frame is as
    /// likely as a late one.
    pub interval_tolerance: f64,
    /// Share of a period after which a frame may belong to the next cycle. The reason is that the
    /// next SYNC may be missed and the grid may be late by jitter. Such a frame is used only if the
    /// next SYNC arrives after it. Convention: 0.75.
    pub doubtful_share: f64,
    /// Largest distance of a repeated SYNC from the latest grid point, in periods. A SYNC at a
    /// larger distance that is still nearer to this point than to the next one fits no grid point:
    /// a clock was set. Convention: 0.25.
    pub repeated_sync: f64,
    /// Largest distance between two SYNCs, in periods, at which the second one is the same frame
    /// again. Convention: 0.01.
    pub echoed_sync: f64,
    /// Number of periods after which a SYNC counts as missing. Derived: a later SYNC would be
    /// nearer to the following grid point.
    pub missing_sync: f64,
    /// Number of consecutive positions that have to agree to confirm each other. Convention: 3.
    pub confirming_positions: u32,
    /// Largest difference between the time by the counter and the time by the stamps \[ns\]. Beyond
    /// it, the counter is assumed to have restarted. Derived: it equals the shortest silence that
    /// ends a train of cycles.
    pub counter_slack_ns: f64,
    /// Width from which on a counter does not wrap within a silence at the usual rates of drives
    /// \[bits\]. For a narrower counter, the allowed difference from the time is at most a quarter
    /// of its range. Derived: 2¹⁶ cycles of 1 ms are 65 s.
    pub wide_counter_bits: u8,
    /// Longest time between two values that are interpolated, in nominal periods. A missing frame
    /// costs its own cycle. It also costs the next cycle if the later value arrives close to the
    /// instant of that cycle. Derived: one missing frame and half a period of jitter.
    pub interpolation_periods: f64,
}

impl AssemblyLimits {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self {
        period_tolerance: 0.01,
        silence: (10.0, 1e9),
        stretch: (100.0, 1e9),
        deviating_stretches: 4,
        interval_tolerance: 0.5,
        doubtful_share: 0.75,
        repeated_sync: 0.25,
        echoed_sync: 0.01,
        missing_sync: 1.5,
        confirming_positions: 3,
        counter_slack_ns: 1e9,
        wide_counter_bits: 16,
        interpolation_periods: 2.5,
    };
}
