//! Friction laws that the data chose, and what each gained.

use serde::Serialize;

use didim_dynamics::robot::{FrictionLaw, JointFriction, JointIndex, SignModel};

/// Change of a joint's friction law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionChange {
    /// Another law for the sign.
    Sign(SignModel),
    /// A term that was not there, or was there with another speed or way.
    Law(FrictionLaw),
}

/// One change, and what it gained.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrictionGain {
    /// The joint.
    pub joint: JointIndex,
    /// The change, with the shape after all changes.
    pub change: FrictionChange,
    /// Relative error of the joint on held-out pieces, before and after.
    pub held_out: [f64; 2],
}

/// Prediction error of a model with certain friction laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FrictionScore {
    /// Relative error over all joints on held-out pieces.
    pub held_out: f64,
    /// Relative uncertainty of the torque where the arm has not been.
    #[serde(rename = "elsewhere")]
    pub extrapolation: f64,
}

/// The friction laws that were chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenFriction {
    /// Friction of each joint.
    pub friction: Vec<JointFriction>,
    /// The changes to what the robot's file states, in the order in which they were made.
    pub gains: Vec<FrictionGain>,
    /// With the laws of the robot's file.
    pub before: FrictionScore,
    /// With those chosen.
    pub after: FrictionScore,
    /// Identifications that were tried.
    pub trials: usize,
}
