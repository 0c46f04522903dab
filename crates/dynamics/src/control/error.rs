//! Faults in a controller's data.

use crate::robot::JointIndex;

/// Reason why a controller cannot be built. Joints are numbered from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControlError {
    /// A gain, limit or time is not a finite number or has an invalid sign. Correct the named key.
    #[error("controller of joint {joint}: {key} = {value} must be {expected}")]
    BadValue {
        /// Joint.
        joint: JointIndex,
        /// The key in the file.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Expected value.
        expected: &'static str,
    },
    /// No loop can have this bandwidth. Give a factor above 0.
    #[error("{factor} times the bandwidth: the factor must be finite and positive")]
    Bandwidth {
        /// The given value.
        factor: f64,
    },
    /// The sample period or the delay is invalid. Correct the named key.
    #[error("controller timing: {key} = {value} must be {expected}")]
    BadTiming {
        /// The key in the file.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Expected value.
        expected: &'static str,
    },
    /// The number of joint controllers is zero or exceeds the largest number of joints.
    #[error("{count} joint controllers: there must be one per joint, 1 to {max}")]
    JointCount {
        /// Number of controllers in the file.
        count: usize,
        /// The largest number of joints.
        max: usize,
    },
    /// A list does not have one value per joint. Give one per joint, in their order.
    #[error("controller: {key} has {found} values for {expected} joints")]
    Length {
        /// The key in the file.
        key: &'static str,
        /// Number of joints of the arm.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A sampled controller was built from continuous data, or vice versa.
    #[error("the controller's timing is not {expected}")]
    WrongTiming {
        /// Expected timing.
        expected: &'static str,
    },
}
