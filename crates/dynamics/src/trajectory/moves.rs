//! A motion as written in a file.

use serde::{Deserialize, Serialize};

/// Start posture of the arm and its moves, one after the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MoveSequence {
    /// Posture before the first move, per joint \[rad\].
    pub start_rad: Vec<f64>,
    /// Dwell there \[s\].
    #[serde(default)]
    pub start_dwell_s: f64,
    /// The moves.
    pub moves: Vec<Move>,
}

/// One point-to-point move of all joints, which start and arrive together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// Target, per joint \[rad\].
    pub target_rad: Vec<f64>,
    /// Part of the velocity limits that the move may use, above 0 and at most 1.
    pub velocity_fraction: f64,
    /// Part of the acceleration limits that the move may use, above 0 and at most 1.
    pub acceleration_fraction: f64,
    /// Dwell at the target \[s\].
    #[serde(default)]
    pub dwell_s: f64,
}
