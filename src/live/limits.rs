//! Limits of the live service.

use std::time::Duration;

/// Limits for the state of a running service.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LiveLimits {
    /// Length of the period of recent counts. Convention: it covers several of the longest cycles,
    /// but is short for a person who waits.
    pub recent_period: Duration,
    /// Shortest time over which recent counts are conclusive \[s\]. Derived: a cycle lasts up to a
    /// second, and counts only after its end.
    pub settled_s: f64,
    /// Share of lost cycles above which the loss is a current fault \[1\]. Convention: a smaller
    /// loss only costs its window, which is reported as rejected.
    pub tolerated_loss_share: f64,
    /// Number of standard deviations beyond which two masses differ \[σ\]. Convention. The combined
    /// standard deviation is too large if both masses have the same error from the arm's model.
    pub load_deviations: f64,
    /// Duration of the counted samples of a load survey \[s\]. Derived: the wrist rotates within
    /// this time, and a load is identifiable from a few seconds of motion.
    pub load_survey_s: f64,
    /// Time without a sample after which a bus is silent. Derived: it is many times the waiting
    /// time of a batch.
    pub silent_after: Duration,
    /// Time by which a thread is late that counts as a pause. Convention: it is shorter than the
    /// time that a receive buffer holds, and longer than the delays of a busy machine.
    pub pause: Duration,
    /// Maximum time of an identification. Convention: many times that of a long window by the
    /// slowest method on a slow processor, and short of a working day.
    pub identification: Duration,
    /// Time after which a thread that identifies and stores is stuck. Convention: longer than a
    /// slow disk takes for a result.
    pub stuck: Duration,
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
        pause: Duration::from_millis(300),
        identification: Duration::from_secs(30 * 60),
        stuck: Duration::from_secs(120),
    };
}
