//! Limits of the live service.

use std::time::Duration;

/// Limits that decide about the state of a running service.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LiveLimits {
    /// Length of the period of recent counts. Convention: several of the longest cycles, and short
    /// compared with the time that people wait.
    pub recent_period: Duration,
    /// Shortest time over which recent counts are conclusive \[s\]. Derived: a cycle takes up to a
    /// second, and is decided when it is over.
    pub settled_s: f64,
    /// Share of lost cycles above which the loss is a current fault \[1\]. Convention: a single
    /// lost cycle costs a window, which is reported there.
    pub tolerated_loss_share: f64,
    /// Number of standard deviations beyond which two masses differ \[σ\]. The standard deviations
    /// are too large if model errors of the arm are part of both masses. Convention.
    pub load_deviations: f64,
    /// Duration of the counted samples of a load survey \[s\]. Derived: the wrist has rotated by
    /// then, and a load is identifiable within seconds.
    pub load_survey_s: f64,
    /// Time without a sample after which a bus is silent. Derived: many times the waiting time of a
    /// batch.
    pub silent_after: Duration,
}

impl LiveLimits {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self = Self {
        recent_period: Duration::from_secs(5),
        settled_s: 2.0,
        tolerated_loss_share: 0.01,
        load_deviations: 3.0,
        load_survey_s: 2.0,
        silent_after: Duration::from_secs(1),
    };
}

impl Default for LiveLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
