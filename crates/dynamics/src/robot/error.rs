//! Faults of a robot file.

use thiserror::Error;

use super::{JointIndex, TransmissionError};

/// Why a robot file was refused; each message gives the fault, its place and the remedy.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RobotError {
    /// Not TOML, an unknown or missing key, or a value of the wrong type.
    #[error("line {line}: {message}")]
    Format {
        /// Line, counted from 1.
        line: usize,
        /// Message of the TOML reader; it names the allowed keys.
        message: String,
    },
    /// The robot or a joint has an empty name.
    #[error("line {line}: `name` is empty; write a name, or for a joint leave the key out")]
    EmptyName {
        /// Line, counted from 1.
        line: usize,
    },
    /// The name of the robot or of a joint is not one line of text.
    #[error(
        "line {line}: `name` has control or format characters; write it on one line, without \
         characters that cannot be seen"
    )]
    ControlInName {
        /// Line, counted from 1.
        line: usize,
    },
    /// Too few or too many joints.
    #[error("the arm has {found} joints; give 1 to {largest} `[[joint]]` tables")]
    JointCount {
        /// Joints in the file.
        found: usize,
        /// The largest number supported.
        largest: usize,
    },
    /// A number is infinite or not a number.
    #[error("line {line}: `{key}` is not a finite number; give its value in the key's unit")]
    NotFinite {
        /// The key.
        key: String,
        /// Line, counted from 1.
        line: usize,
    },
    /// A joint has no limit.
    #[error("line {line}: joint {joint} has no `{key}`; add it, limits have no default")]
    MissingLimit {
        /// Joint.
        joint: JointIndex,
        /// The missing key.
        key: &'static str,
        /// Line of the joint, counted from 1.
        line: usize,
    },
    /// A limit has the unit of the other kind of joint.
    #[error("line {line}: `{key}` does not fit the type of joint {joint}; use `{instead}`")]
    WrongUnit {
        /// Joint.
        joint: JointIndex,
        /// The key found.
        key: &'static str,
        /// The key that fits.
        instead: &'static str,
        /// Line, counted from 1.
        line: usize,
    },
    /// The limits of a position leave no range.
    #[error("line {line}: `{min}` of joint {joint} is not below `{max}`; swap or correct them")]
    LimitOrder {
        /// Joint.
        joint: JointIndex,
        /// Key of the lower limit.
        min: &'static str,
        /// Key of the upper limit.
        max: &'static str,
        /// Line, counted from 1.
        line: usize,
    },
    /// A limit on speed or torque is zero or negative.
    #[error("line {line}: `{key}` of joint {joint} is not positive; limits are magnitudes")]
    NotPositive {
        /// Joint.
        joint: JointIndex,
        /// The key.
        key: &'static str,
        /// Line, counted from 1.
        line: usize,
    },
    /// The transmission matrix cannot be used.
    #[error("line {line}: `transmission.rows` (q_motor = R q_joint): {source}")]
    Transmission {
        /// Line, counted from 1.
        line: usize,
        /// Fault of the matrix.
        source: TransmissionError,
    },
    /// Coulomb friction without a sign model, or a term that needs Coulomb friction without it.
    #[error(
        "line {line}: give `sign` in [friction] if and only if `coulomb` is true, and `sign`, \
         `load`, `stribeck_rad_s` or `hysteresis_rad` of a joint only then"
    )]
    SignModel {
        /// Line, counted from 1.
        line: usize,
    },
    /// A nominal value for a parameter that the robot does not have.
    #[error("line {line}: the robot has no parameter `{name}`; its parameters are {available}")]
    UnknownParameter {
        /// The name found.
        name: String,
        /// Names that exist.
        available: String,
        /// Line, counted from 1.
        line: usize,
    },
    /// Two nominal values for one parameter, such as `zz1` and `zz1r`.
    #[error("line {line}: `{name}` has a value already; keep one, `r` only marks a regrouped one")]
    DuplicateParameter {
        /// The name found second.
        name: String,
        /// Line, counted from 1.
        line: usize,
    },
}
