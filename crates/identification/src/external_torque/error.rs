//! Errors of an observer.

use crate::identification::IdentificationError;

/// Reason why an observer cannot be created.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ObserverError {
    /// The parameters are not those of the robot. Remedy: use the robot of the identification.
    #[error(transparent)]
    Parameters(#[from] IdentificationError),
    /// The result has no covariance. Remedy: identify again with this version.
    #[error(
        "the result has no covariance of its parameters, from which the uncertainty of an external \
         torque follows; identify again"
    )]
    NoCovariance,
    /// A value is invalid.
    #[error("{what} = {value} must be {expected}")]
    BadValue {
        /// Name of the value.
        what: &'static str,
        /// The value.
        value: f64,
        /// Valid values.
        expected: &'static str,
    },
    /// A list does not have one value for each joint.
    #[error("{what}: {found} values for {expected} joints")]
    Length {
        /// Name of the list.
        what: &'static str,
        /// Number of joints of the arm.
        expected: usize,
        /// Number of values.
        found: usize,
    },
}
