//! Reasons why no gains are found.

use didim_dynamics::robot::JointIndex;
use thiserror::Error;

use crate::identification::problem::{ExperimentError, IdentificationError};
use crate::regression::RegressionError;

/// Reason why no gains are found; each message says what to do.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GainsError {
    /// Mass or centre of the load is invalid.
    #[error(
        "a load of {mass_kg} kg with its centre at {centre_m:?} m: the mass has to be above 0 and \
        all be finite; weigh the load"
    )]
    Load {
        /// Configured mass \[kg\].
        mass_kg: f64,
        /// Configured centre \[m\].
        centre_m: [f64; 3],
    },
    /// The torque of some joints is not used, so that their gains cannot be found. Use the torques
    /// of all joints.
    #[error(
        "no torque is used of joint {}, and gains are found of all drives together; leave `joints` \
         out", joints.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
    )]
    MissingTorques {
        /// Joints whose torque is not used.
        joints: Vec<JointIndex>,
    },
    /// The robot file has a known torque in N·m, but without a load no gain is known in N·m.
    #[error(
        "this robot has an additional known torque in N·m, and without a load nothing else is in \
        N·m; record with a known load, too"
    )]
    KnownTorque,
    /// The load determines the torque of no drive.
    #[error(
        "along the recording with the load its weight and its centre move no drive; move the \
         joints that carry it, in several orientations to gravity"
    )]
    Unseen,
    /// The recordings do not identify the gains.
    #[error(
        "the recordings do not identify the gains of joints {}: their torques depend too little on \
        other joints or on a load. Use a heavier load, further from the axes, and the same wide \
        motion of all joints in both recordings", text(.joints)
    )]
    NotIdentifiable {
        /// Joints of these drives.
        joints: Vec<JointIndex>,
    },
    /// The estimate does not converge.
    #[error(
        "the gains do not converge in {steps} steps: the recordings hold too little information. \
        Use a heavier load, further from the axes. Carry it during one complete recording and not \
        in the other"
    )]
    NotSettled {
        /// Number of steps taken.
        steps: usize,
    },
    /// A friction law of the robot depends on the load.
    #[error(
        "friction of this robot grows with the load (`fcl`), and the load is known only with the \
        gains. Remove the law `load` from the robot file for this command, and identify with it \
        afterwards"
    )]
    LoadFriction,
    /// The equation has no solution.
    #[error("the gains: {0}")]
    Regression(RegressionError),
    /// Robot, recordings and options do not form an identification.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// The two recordings are not of the same arm.
    #[error("the recordings without and with the load: {0}")]
    Experiment(#[from] ExperimentError),
}

fn text(joints: &[JointIndex]) -> String {
    joints.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}
