//! Why a model cannot be written as code.

use didim_dynamics::dynamics::UnknownBaseParameter;
use didim_dynamics::robot::{FrictionLaw, JointIndex};

/// Why a model cannot be written as code.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CodeError {
    /// A joint has a known torque in the robot file, which cannot be written as code.
    #[error(
        "joint {joint} has a `known_torque`, which is not written as code; take it off the joint's \
         torque by yourself, and remove it from the robot's file for this export"
    )]
    KnownTorque {
        /// The joint.
        joint: JointIndex,
    },
    /// A friction law depends on more than the speed, which cannot be written as code.
    #[error(
        "friction of joint {joint} has `{law}`, which is not written as code: that has friction by \
         the speed alone; identify without it for this export"
    )]
    Friction {
        /// The joint.
        joint: JointIndex,
        /// A law that depends on the load or on the positions of reversals.
        law: FrictionLaw,
    },
    /// The covariance of the parameters is not positive definite. Identify again.
    #[error("the covariance of the parameters is not positive definite; identify again")]
    Covariance,
    /// An identified parameter does not belong to this robot.
    #[error(
        "a parameter that was identified is none of the robot's; give the cell that it was \
        identified with"
    )]
    Identified,
    /// The same, by name.
    #[error(transparent)]
    Parameter(UnknownBaseParameter),
}
