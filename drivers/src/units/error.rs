//! Errors that refuse gains.

use didim_dynamics::robot::MotorIndex;

/// Reason why gains were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitsError {
    /// The number of drives differs from the number of axes.
    #[error("`drives`: {found} for {axes} axes; give one per axis, in their order")]
    Drives {
        /// Number of axes of the layout.
        axes: usize,
        /// Number of drives in the cell file.
        found: usize,
    },
    /// A number cannot be the gain or the zero of a drive.
    #[error("drive {axis}: `{key}` is {value}; it has to be {expected}")]
    Number {
        /// Motor of the drive.
        axis: MotorIndex,
        /// Key of the number.
        key: &'static str,
        /// Value of the number.
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
        /// Motor of the drive.
        axis: MotorIndex,
        /// Name of the signal, as `Message.Signal`.
        signal: String,
        /// Unit of the signal in the DBC file.
        unit: String,
        /// Units that the gain accepts.
        expected: String,
    },
    /// A signal is configured to wrap, but its values cannot wrap.
    #[error("drive {axis}: `wraps = \"modulo\"`, and `{signal}` is not an integer")]
    NoModulus {
        /// Motor of the drive.
        axis: MotorIndex,
        /// Name of the signal, as `Message.Signal`.
        signal: String,
    },
}
