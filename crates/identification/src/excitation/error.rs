//! Errors of a motion design.

use super::limit_kind::LimitKind;
use super::shapes::Nearest;
use didim_dynamics::robot::JointIndex;

/// Reason why no motion can be designed. Joints are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExcitationError {
    /// A joint has no acceleration limit. Remedy: configure it.
    #[error(
        "joint {joint}: without an acceleration limit or parameters the possible acceleration \
            is unknown; state acceleration_max_rad_s2 in the robot file, or give --acceleration"
    )]
    NoAcceleration {
        /// The joint.
        joint: JointIndex,
    },
    /// The robot file lacks a limit that the motion has to keep. Remedy: add it.
    #[error(
        "joint {joint}: the {what} limit is unknown, and a motion needs it; state {key} in the \
            robot file"
    )]
    OpenLimit {
        /// The joint.
        joint: JointIndex,
        /// Name of the limited quantity.
        what: &'static str,
        /// Key in the robot file.
        key: &'static str,
    },
    /// A value is invalid.
    #[error("{what} = {value} must be {expected}")]
    BadValue {
        /// Name of the quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Valid values.
        expected: &'static str,
    },
    /// A list does not have one value per joint.
    #[error("{what}: {found} values for {expected} joints")]
    Length {
        /// Name of the quantity.
        what: &'static str,
        /// Number of joints of the arm.
        expected: usize,
        /// Number of given values.
        found: usize,
    },
    /// The arm cannot rest in the middle of its ranges. Remedy: correct the limits or the
    /// parameters.
    #[error(
        "at rest in the middle of its ranges the {kind} of joint {joint} is {share:.2} times its \
         limit; check the limits of the robot file and its parameters"
    )]
    Middle {
        /// The joint.
        joint: JointIndex,
        /// Kind of the limit.
        kind: LimitKind,
        /// Used share of the limit.
        share: f64,
    },
    /// The arm cannot hold itself within its torque limits in any tried posture. Remedy: correct
    /// the limits, the masses or the direction of gravity.
    #[error(
        "the arm cannot hold itself within its limits: at rest in the middle of its ranges joint \
         {joint} needs {share:.2} times the torque that a motion may use. No other tried posture \
         is within the limits. Check the torque limits, the masses and gravity"
    )]
    CannotHold {
        /// The joint.
        joint: JointIndex,
        /// Torque at rest, as a share of the usable limit.
        share: f64,
    },
    /// The first posture is outside the limits. Remedy: begin in another posture.
    #[error(
        "in the first posture the {kind} of joint {joint} is {share:.2} times what a motion may \
         use; begin in another posture"
    )]
    FirstPosture {
        /// The joint.
        joint: JointIndex,
        /// Kind of the limit.
        kind: LimitKind,
        /// Used share of the limit.
        share: f64,
    },
    /// Shapes are too close to each other in the first posture. Remedy: begin in another posture.
    #[error(
        "in the first posture, at 0 s, the arm collides: {nearest}, and a motion keeps 20 mm; \
         begin in another posture, or correct the shapes"
    )]
    FirstPostureTouches {
        /// The narrowest gap.
        nearest: Nearest,
    },
    /// Shapes are too close to each other or to a wall in all tried postures. Remedy: correct the
    /// shapes, the box or the floor.
    #[error(
        "in every tried posture the arm's shapes are less than 20 mm from each other or from the \
         box or the floor{}. Check the shapes in the robot file or the URDF, the box, and the \
         height of the floor",
        nearest.map_or_else(String::new, |of| format!("; in the middle of its ranges {of}"))
    )]
    Touching {
        /// The narrowest gap in the middle of the ranges.
        nearest: Option<Nearest>,
    },
    /// No joint can move far enough within the limits. Remedy: correct the limits.
    #[error(
        "no joint can swing within these limits, as far as one degree, from any posture that was \
         tried; check the limits of the robot file and its parameters"
    )]
    NoExcitation,
    /// A joint has too little range or time for three speeds. Remedy: give more time, or sweep
    /// fewer joints.
    #[error(
        "joint {joint}: within these limits and {seconds:.3} s it cannot hold three speeds; make \
        the sweep longer, or sweep fewer joints"
    )]
    NoSweep {
        /// The joint.
        joint: JointIndex,
        /// Available time \[s\].
        seconds: f64,
    },
    /// A required parameter is not among the identified ones.
    #[error("no parameter `{name}` is identified; there are {}", available.join(" "))]
    UnknownParameter {
        /// The name.
        name: String,
        /// Identified parameters.
        available: Vec<String>,
    },
    /// No motion within the limits identifies all parameters. Remedy: allow more time, or more
    /// joints.
    #[error(
        "a motion of {duration_s} s within these limits cannot identify some parameters; make \
            the motion longer, let more joints move, or identify fewer parameters"
    )]
    NotIdentifiable {
        /// Duration of the motion \[s\].
        duration_s: f64,
    },
}
