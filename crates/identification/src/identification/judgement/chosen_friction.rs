//! Friction laws that the data chose, and the error reduction of each.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::stored_value::number;

use didim_dynamics::robot::{FrictionLaw, JointFriction, JointIndex, SignModel};

/// Change of a joint's friction law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionChange {
    /// Another model of the sign function.
    Sign(SignModel),
    /// New friction term, or an existing term with another speed or presliding distance.
    Law(FrictionLaw),
}

/// One change, and its effect on the held-out error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrictionGain {
    /// The joint.
    pub joint: JointIndex,
    /// The change, with its final shape parameters.
    pub change: FrictionChange,
    /// Relative error of the joint on held-out folds, before and after the change.
    pub held_out: [f64; 2],
}

/// Prediction error of a model with certain friction laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrictionScore {
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

/// Friction laws that the data chose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChosenFriction {
    /// Friction of each joint.
    pub friction: Vec<JointFriction>,
    /// Changes to the friction laws of the robot file, in the order in which they were made.
    #[serde(default)]
    pub gains: Vec<FrictionGain>,
    /// Score with the laws of the robot file.
    #[serde(default)]
    pub before: FrictionScore,
    /// Score with the chosen laws.
    #[serde(default)]
    pub after: FrictionScore,
    /// Number of identifications that were tried.
    #[serde(default)]
    pub trials: usize,
}
