//! A motion as it stands in a file.

use serde::{Deserialize, Serialize};

/// Where the arm starts and where it goes, one move after the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MoveSequence {
    /// Where the arm stands before the first move, per joint \[rad\].
    pub start_rad: Vec<f64>,
    /// How long it stays there \[s\].
    #[serde(default)]
    pub start_dwell_s: f64,
    /// The moves.
    pub moves: Vec<Move>,
}

/// One point-to-point move of all joints, which start and arrive together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// Where to go, per joint \[rad\].
    pub target_rad: Vec<f64>,
    /// Part of the velocity limits that the move may use, above 0 and at most 1.
    pub velocity_fraction: f64,
    /// Part of the acceleration limits that the move may use, above 0 and at most 1.
    pub acceleration_fraction: f64,
    /// How long to stay at the target \[s\].
    #[serde(default)]
    pub dwell_s: f64,
}
