//! How far errors of the model may set one result apart from another.

use serde::{Deserialize, Serialize};

use super::timestamp::Timestamp;

/// What errors of the model make of the differences to another result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Against {
    /// Number of the other.
    pub result: u64,
    /// When that was stored.
    pub time: Timestamp,
    /// Their standard deviation, of each parameter in its unit. Sizes: single precision is plenty.
    pub standard_deviations: Vec<f32>,
}
