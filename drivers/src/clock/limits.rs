//! Limits of the mapping of clocks.

/// Limits that decide about changes of a clock.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ClockLimits {
    /// Smallest change of the offset that is a step \[ns\]. Convention: both clocks are slewed
    /// alike (adjtimex(2)), so their offset should change only in steps. On a virtual machine it
    /// may also change a little.
    pub(crate) step_ns: u64,
    /// Largest change of the offset that is ignored \[ns\]. Convention.
    pub(crate) noise_ns: u128,
    /// Time for which stamps of before a step may still be on their way \[ns\]. Convention.
    pub(crate) transmission_ns: u64,
    /// Time over which differences are collected before they become the offset of a hardware clock
    /// \[ns\]. Derived: a crystal of 100 ppm drifts by 0.1 ms in this time.
    pub(crate) hardware_window_ns: u64,
    /// Delay of a software stamp from which on a hardware clock was set \[ns\]. Convention: a late
    /// interrupt does not explain it.
    pub(crate) hardware_step_ns: i128,
}

impl ClockLimits {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self = Self {
        step_ns: 1_000_000,
        noise_ns: 1_000,
        transmission_ns: 1_000_000_000,
        hardware_window_ns: 1_000_000_000,
        hardware_step_ns: 20_000_000,
    };

    /// Returns the time after a step in which stamps of the earlier clock may still arrive \[ns\].
    /// A hardware clock uses the earlier offset in the window of the step and in the one after it.
    pub(crate) const fn step_memory_ns(&self) -> u64 {
        self.transmission_ns + 2 * self.hardware_window_ns
    }
}
