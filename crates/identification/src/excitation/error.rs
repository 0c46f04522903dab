//! Errors of a motion design.

use super::limit_kind::LimitKind;
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
    /// Shapes are too close to each other or to the box in all tried postures. Remedy: correct the
    /// shapes or the box.
    #[error(
        "in every tried posture the arm's shapes are less than 20 mm from each other or from a \
         side of the box. Check `capsules` in the robot file, the URDF's collision shapes, and the \
         box"
    )]
    Touching,
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
