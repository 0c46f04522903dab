//! Errors that refuse gains.

/// Reason why gains were refused. Axes count from 1.
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
        /// The axis.
        axis: usize,
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
        /// The axis.
        axis: usize,
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
        /// The axis.
        axis: usize,
        /// `Message.Signal`.
        signal: String,
    },
}
