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
    /// The recording times of the messages.
    Log,
    /// None: each message is one row.
    Rows,
}

/// Configuration of a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct BagSpec {
    /// Names of the joints in the messages, in the arm's order.
    pub joints: Vec<String>,
    /// The topic, if several have these joints.
    pub topic: Option<String>,
    /// Samples per second.
    pub rate_hz: f64,
    /// Side of the transmission.
    pub side: Side,
    /// Value of an effort of 1 of each joint, including its sign \[N·m or N\].
    pub torque_scales: Vec<f64>,
    /// True for each joint whose angle wraps at a turn; empty if none does.
    pub wraps: Vec<bool>,
    /// Clock of the samples.
    pub time: BagTime,
}
