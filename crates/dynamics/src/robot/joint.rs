//! One joint of the arm: its place in the chain and its limits.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Angle;

/// Motion of a joint along or about its z axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Rotation about z; q in rad, torque in N·m.
    Revolute,
    /// Translation along z; q in m, force in N.
    Prismatic,
}

impl JointKind {
    /// Returns the SI unit of its position.
    pub fn position_unit(self) -> &'static str {
        match self {
            Self::Revolute => "rad",
            Self::Prismatic => "m",
        }
    }

    /// Returns the SI unit of its velocity.
    pub fn velocity_unit(self) -> &'static str {
        match self {
            Self::Revolute => "rad/s",
            Self::Prismatic => "m/s",
        }
    }

    /// Returns the SI unit of the drive's torque or force.
    pub fn torque_unit(self) -> &'static str {
        match self {
            Self::Revolute => "N·m",
            Self::Prismatic => "N",
        }
    }
}

/// Limits of a joint, in rad or m by its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Smallest position \[rad or m\].
    pub position_min: f64,
    /// Largest position \[rad or m\].
    pub position_max: f64,
    /// Largest speed, unless the file leaves it open \[rad/s or m/s\].
    pub velocity_max: Option<f64>,
    /// Largest acceleration, where it is stated \[rad/s² or m/s²\].
    pub acceleration_max: Option<f64>,
    /// Largest jerk, where it is stated \[rad/s³ or m/s³\].
    pub jerk_max: Option<f64>,
    /// Largest torque or force on the joint side, unless the file leaves it open \[N·m or N\].
    pub torque_max: Option<f64>,
}

/// A joint and the link it carries, in modified Denavit–Hartenberg parameters (Khalil and
/// Dombre, *Modeling, Identification and Control of Robots*, ch. 3): the frame of link j in that
/// of link j−1 is RotX(α) · TransX(d) · RotZ(θ) · TransZ(r).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Kind of the joint: a revolute one changes θ, a prismatic one changes r.
    pub kind: JointKind,
    /// α, from z of the previous link to z of this one about the previous x.
    pub alpha: Angle,
    /// d \[m\], from z of the previous link to z of this one along the previous x.
    pub d_m: f64,
    /// θ at q = 0 of a revolute joint; the constant θ of a prismatic one.
    pub theta: Angle,
    /// r \[m\] at q = 0 of a prismatic joint; the constant r of a revolute one.
    pub r_m: f64,
    /// Limits of the joint.
    pub limits: Limits,
    /// True if the inertia of the joint's drive is a parameter of the model.
    pub drive_inertia: bool,
}
