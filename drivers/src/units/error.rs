//! Errors that refuse gains.

use didim_dynamics::robot::MotorIndex;

/// Reason why gains were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitsError {
    /// The number of drives differs from the number of axes.
    #[error("`drives`: {found} for {axes} axes; give one per axis, in their order")]
    Drives {
        /// Axes of the layout.
        axes: usize,
        /// Drives given.
        found: usize,
    },
    /// A number is impossible for a drive.
    #[error("drive {axis}: `{key}` is {value}; it has to be {expected}")]
    Number {
        /// The motor of the drive.
        axis: MotorIndex,
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Allowed values.
        expected: &'static str,
    },
    /// The DBC file has the signal in another unit than the gain expects.
    #[error(
        "drive {axis}: the gain expects {expected}, and `{signal}` of the DBC file is in \
         \"{unit}\"; choose the scale for that unit, or correct the unit in the DBC file"
    )]
    WrongUnit {
        /// The motor of the drive.
        axis: MotorIndex,
        /// `Message.Signal`.
        signal: String,
        /// The unit there.
        unit: String,
        /// Units that would match.
        expected: String,
    },
    /// A signal is configured to wrap, but cannot.
    #[error("drive {axis}: `wraps = \"modulo\"`, and `{signal}` is not an integer")]
    NoModulus {
        /// The motor of the drive.
        axis: MotorIndex,
        /// `Message.Signal`.
        signal: String,
    },
}
