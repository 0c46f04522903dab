//! Cut-off of the position filter that the data chose.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::stored_value::number;

/// Result of one tried cut-off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CutoffTrial {
    /// Cut-off frequency of one pass \[Hz\].
    pub cutoff_hz: f64,
    /// Relative error over all joints on held-out folds.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub held_out: f64,
    /// Relative torque uncertainty outside the recorded motion.
    #[serde(rename = "elsewhere")]
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub extrapolation: f64,
}

/// Chosen cut-off and the tried cut-offs, in ascending order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChosenCutoff {
    /// Cut-off frequency of one pass \[Hz\].
    pub cutoff_hz: f64,
    /// Every cut-off for which the identification succeeded.
    #[serde(default)]
    pub trials: Vec<CutoffTrial>,
}
