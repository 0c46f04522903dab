//! Configuration of a bag.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::measurement::Side;

/// Clock of the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BagTime {
    /// The stamps in the messages.
    #[default]
    Header,
    /// When they were recorded.
    Log,
    /// None: each message is one row.
    Rows,
}

/// Configuration of a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct BagSpec {
    /// Names of the joints in the messages, in the arm's order.
    pub joints: Vec<String>,
    /// The topic, where several have them.
    pub topic: Option<String>,
    /// Samples per second.
    pub rate_hz: f64,
    /// Side of the transmission.
    pub side: Side,
    /// N·m or N to a 1 of each effort, its sign included.
    pub torque_scales: Vec<f64>,
    /// Clock of the samples.
    pub time: BagTime,
}
