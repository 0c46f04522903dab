//! Faults of a motion. Joints and moves are numbered from 1; move 0 is the start.

use crate::robot::JointIndex;

/// Why a motion cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// A position list has the wrong length. Give one position per joint.
    #[error("move {number}: {found} positions for {expected} joints")]
    JointCount {
        /// The move, 0 for the start.
        number: usize,
        /// Joints of the arm.
        expected: usize,
        /// Positions given.
        found: usize,
    },
    /// The arm has no joint or more than an arm can have.
    #[error("{count} joints: there must be 1 to {max}")]
    ArmSize {
        /// Joints given.
        count: usize,
        /// The largest number of joints.
        max: usize,
    },
    /// The target lies outside the joint's range. Move it inside.
    #[error(
        "move {number}, joint {joint}: position {position_rad} rad is outside {min_rad} to \
        {max_rad} rad"
    )]
    PositionLimit {
        /// The move, 0 for the start.
        number: usize,
        /// The joint.
        joint: JointIndex,
        /// Target of the move \[rad\].
        position_rad: f64,
        /// Lower limit \[rad\].
        min_rad: f64,
        /// Upper limit \[rad\].
        max_rad: f64,
    },
    /// A fraction of a limit is not above 0 and at most 1.
    #[error("move {number}: {key} = {value} must be above 0 and at most 1")]
    Fraction {
        /// The move.
        number: usize,
        /// The key in the file.
        key: &'static str,
        /// Its value.
        value: f64,
    },
    /// A dwell is negative or not finite.
    #[error("move {number}: dwell_s = {value} must be finite and not negative")]
    Dwell {
        /// The move, 0 for the start.
        number: usize,
        /// Its value \[s\].
        value: f64,
    },
    /// No joint moves. Use the dwell of the move before to stay.
    #[error("move {number} goes where the arm already is: lengthen the dwell before it instead")]
    NoMotion {
        /// The move.
        number: usize,
    },
    /// The limits of a joint are invalid.
    #[error("limits of joint {joint}: {key} = {value} must be {expected}")]
    BadLimit {
        /// The joint.
        joint: JointIndex,
        /// The key in the file.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Allowed range.
        expected: &'static str,
    },
    /// A recorded reference is empty, ragged, not finite or has no sample rate.
    #[error("recorded reference: {reason}")]
    BadRecord {
        /// The problem.
        reason: &'static str,
    },
    /// A value of the random move generator is invalid.
    #[error("random moves: {key} must be {expected}")]
    BadGenerator {
        /// The field.
        key: &'static str,
        /// Allowed range.
        expected: &'static str,
    },
}
