//! Reasons why a least-squares problem has no trustworthy solution.

use didim_dynamics::robot::JointIndex;
use thiserror::Error;

/// Fault of an overdetermined system; indices count from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RegressionError {
    /// The sizes do not match: X needs one row per measurement, the same number for every joint.
    /// This is a programming error of the caller.
    #[error(
        "an observation matrix of {rows} x {columns}, {measurements} measurements and {joints} \
            joints do not fit together"
    )]
    Shape {
        /// Rows of X.
        rows: usize,
        /// Columns of X.
        columns: usize,
        /// Length of y.
        measurements: usize,
        /// Joints.
        joints: usize,
    },
    /// There are no more rows than parameters, so the noise cannot be estimated. Remedy: a longer
    /// record, a smaller decimation factor, or fewer parameters.
    #[error("{rows} rows are too few for {columns} parameters")]
    TooFewRows {
        /// Rows of X, all joints.
        rows: usize,
        /// Columns of X.
        columns: usize,
    },
    /// An entry of X or y is not finite. Remedy: find the sample in the record.
    #[error("the equation of joint {joint}, row {row} holds a value that is not finite")]
    NotFinite {
        /// Joint of the equation.
        joint: JointIndex,
        /// Row within the joint.
        row: usize,
    },
    /// Values so large or small that their squares leave double precision. Remedy: check the units.
    #[error("the values are too large or too small to be squared; check the units")]
    OutOfRange,
    /// Every measurement of a joint is zero, so it has no relative error and no weight. Remedy:
    /// check that the torque of this joint is recorded.
    #[error("every measurement of joint {joint} is zero")]
    NoMeasurement {
        /// The joint.
        joint: JointIndex,
    },
    /// Columns are zero, or zero but for rounding: the motion does not excite these parameters.
    /// Remedy: leave them out, or move the joints concerned.
    #[error("the motion does not excite columns {columns:?}")]
    ZeroColumns {
        /// The columns.
        columns: Vec<usize>,
    },
    /// Columns are linearly dependent: only a combination of these parameters can be identified
    /// from this motion. Remedy: leave some of them out, or move along a richer trajectory.
    #[error("columns {columns:?} are linearly dependent")]
    DependentColumns {
        /// Every column that takes part in a dependency.
        columns: Vec<usize>,
    },
    /// A noise level for weighting is not a positive number. Remedy: take those of
    /// [`Observations::noise_levels`](super::Observations::noise_levels).
    #[error("noise level {level} of joint {joint} is not a positive number")]
    NoiseLevel {
        /// The joint.
        joint: JointIndex,
        /// Given level, in the unit of the measurements.
        level: f64,
    },
    /// A tuning constant is not a positive number. Remedy: 1.345 for Huber's loss, 4.685 for the
    /// bisquare.
    #[error(
        "robust: tuning = {tuning} must be greater than 0; usual are 1.345 (huber) and 4.685 \
         (bisquare)"
    )]
    Tuning {
        /// The value given.
        tuning: f64,
    },
    /// The M-estimate does not converge: several fits are equally good. Remedy: a larger tuning
    /// constant, Huber's loss, or an inspection of the record.
    #[error(
        "the robust estimate does not converge ({steps} steps): too many rows are outliers, and \
        several fits are equally good. Set a larger tuning constant or kind = \"huber\", and check \
        the measurement"
    )]
    NotSettled {
        /// Steps taken.
        steps: usize,
    },
    /// The singular values were not found within the allowed iterations. Remedy: scale the columns.
    /// This was never seen with finite data of usual range.
    #[error("the singular values of the observation matrix could not be computed")]
    SingularValues,
}
