//! Limits of the assembly.

/// Limits that decide about frames and cycles.
///
/// They follow from the jitter of ordinary operating systems, not from any robot. A cell cannot
/// change them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssemblyLimits {
    /// Largest relative deviation from the nominal period at which cycles are counted \[1\]. A
    /// controller on an ordinary operating system is within it, and a larger deviation means
    /// another configuration. Convention: 0.01.
    pub period_tolerance: f64,
    /// Smallest silence that ends a train of cycles, in nominal periods and in time \[ns\]: the
    /// longer one counts. The next stamp is a new start. Convention: 10 periods and 1 s.
    pub silence: (f64, f64),
    /// Shortest stretch whose period is compared with the nominal one, in cycles and in time
    /// \[ns\]: the longer one counts. Convention: 100 cycles and 1 s.
    pub stretch: (f64, f64),
    /// Number of consecutive stretches that have to deviate in the same direction for a wrong
    /// period. Derived: frames that become permanently late, or punctual again, shift only one
    /// stretch.
    pub deviating_stretches: i32,
    /// Largest deviation of an interval of one period without a counter, in periods. Derived:
    /// beyond half a period, a lost frame is as likely as a late one.
    pub interval_tolerance: f64,
    /// Share of a period after which a frame may belong to the next cycle: its SYNC may be missed
    /// and the grid late by jitter. Such a frame is trusted only if the next SYNC arrives after it.
    /// Convention: 0.75.
    pub doubtful_share: f64,
    /// Largest distance of a repeated SYNC from the latest grid point, in periods. A SYNC beyond it
    /// that is still nearer to this point than to the next one fits no grid point. Convention:
    /// 0.25.
    pub repeated_sync: f64,
    /// Largest distance to the previous SYNC, in periods, at which a SYNC is the same frame again.
    /// Convention: 0.01.
    pub echoed_sync: f64,
    /// Number of periods after which a SYNC counts as missing. Derived: the next one would be the
    /// nearer grid point.
    pub missing_sync: f64,
    /// Number of consecutive positions that have to agree to confirm each other. Convention: 3.
    pub confirming_positions: u32,
    /// Allowed difference between counter and time \[ns\]. Derived: the shortest silence that is a
    /// restart. If a sender or a kernel is busy for longer, the count is assumed to be a new one.
    pub counter_slack_ns: f64,
    /// Narrowest counter that does not wrap within a silence at the usual rates of drives \[bits\].
    /// A narrower counter is trusted for a quarter of its range. Derived: 2¹⁶ cycles of 1 ms are 65
    /// s.
    pub wide_counter_bits: u8,
    /// Longest time between two values that are interpolated, in nominal periods. A missing frame
    /// costs its own cycle, and the cycle after it if the later value has arrived close to that
    /// cycle's instant. Derived: one missing frame and half a period of jitter.
    pub interpolation_periods: f64,
}

impl Default for AssemblyLimits {
    fn default() -> Self {
        Self {
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
        }
    }
}
