//! Errors of a simulation. Joints are numbered from 1.

use crate::robot::JointIndex;
use core::fmt;

use crate::control::ControlError;

/// Why a closed loop cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// The data of the controller are invalid.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// A list does not fit the arm. Give one value per joint (or motor, or parameter).
    #[error("{what}: {found} values where the arm needs {expected}")]
    Length {
        /// Name of the list.
        what: &'static str,
        /// Number that the arm needs.
        expected: usize,
        /// Length of the list.
        found: usize,
    },
    /// A value is invalid. Correct the named key.
    #[error("{what} = {value} must be {expected}")]
    BadValue {
        /// Name of the value.
        what: &'static str,
        /// The given value.
        value: f64,
        /// Allowed range.
        expected: &'static str,
    },
    /// Flexible parts have more inertia than the arm at its start. Remedy: less of it.
    #[error(
        "unmodelled.flexible: the mass matrix less inertia_kg_m2 is not positive definite at joint \
         {joint}; hang less inertia on its spring, or on one of the joints after it"
    )]
    FlexibleInertia {
        /// The joint nearest to the tip whose remaining inertia, with all joints after it free, is
        /// not positive.
        joint: JointIndex,
    },
    /// A part of the loop is not differentiable, or its derivatives are not implemented. Remedy:
    /// leave it out of a loop with sensitivities.
    #[error("a loop with {what} has no sensitivities; leave them out")]
    NoSensitivity {
        /// Name of this part.
        what: &'static str,
    },
}

/// Why a simulation cannot go on. It has ended until it is restarted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// A state is not finite or beyond the divergence limits: the loop is unstable with these
    /// parameters and gains, or the step is too long for them.
    #[error("joint {joint} diverged at {time_s:.6} s: {quantity} is {value}")]
    Divergence {
        /// The joint.
        joint: JointIndex,
        /// Time of the simulation \[s\].
        time_s: f64,
        /// Quantity that left its bounds.
        quantity: StateQuantity,
        /// Its value.
        value: f64,
    },
    /// The mass matrix is not positive definite: the parameters belong to no arm.
    #[error(
        "the mass matrix is not positive definite at joint {joint}, {time_s:.6} s: \
         the parameters belong to no arm"
    )]
    NotPositiveDefinite {
        /// The joint nearest to the tip whose inertia, with all joints after it free, is not
        /// positive.
        joint: JointIndex,
        /// Time of the simulation \[s\].
        time_s: f64,
    },
}

/// A state of the loop that can diverge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateQuantity {
    /// q_r − q \[rad\].
    PositionError,
    /// q̇ \[rad/s\].
    Velocity,
}

impl fmt::Display for StateQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PositionError => "the position error in rad",
            Self::Velocity => "the velocity in rad/s",
        })
    }
}
