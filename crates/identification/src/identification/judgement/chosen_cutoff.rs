//! Cut-off of the position filter that the data chose.

use serde::Serialize;

/// Result of one tried cut-off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CutoffTrial {
    /// Cut-off frequency of one pass \[Hz\].
    pub cutoff_hz: f64,
    /// Relative error over all joints on held-out folds.
    pub held_out: f64,
    /// Relative torque uncertainty outside the recorded motion.
    #[serde(rename = "elsewhere")]
    pub extrapolation: f64,
}

/// Chosen cut-off and the tried cut-offs, in ascending order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenCutoff {
    /// Cut-off frequency of one pass \[Hz\].
    pub cutoff_hz: f64,
    /// Every cut-off for which the identification succeeded.
    pub trials: Vec<CutoffTrial>,
}
