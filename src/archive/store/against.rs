//! Possible difference between two results due to model errors.

use serde::{Deserialize, Serialize};

use super::timestamp::Timestamp;

/// Contribution of model errors to the differences from another result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelDifference {
    /// Number of the other result.
    pub result: u64,
    /// Time at which the other result was stored.
    pub time: Timestamp,
    /// Standard deviation of each parameter's difference, in the parameter's unit. Single precision
    /// is sufficient for these magnitudes.
    pub standard_deviations: Vec<f32>,
}
