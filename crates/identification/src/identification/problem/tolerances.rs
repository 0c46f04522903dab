//! Tolerances of the configured values of cell and robot.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Invalid tolerance.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("tolerance {name} = {value} must be finite and greater than 0: nothing is known perfectly")]
pub struct ToleranceError {
    /// Key of the tolerance.
    pub name: &'static str,
    /// Configured value.
    pub value: f64,
}

/// Tolerances of the configured values of cell and robot: one standard deviation of each.
///
/// They are part of every combined uncertainty. The defaults are those of a cell that was set up
/// with care and not calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tolerances {
    /// Relative error of a joint's torque gain, and of a factor common to all \[share\].
    pub torque_gain: f64,
    /// Error of the instant at which a joint's torque is valid \[s\].
    pub torque_delay_s: f64,
    /// Error of a revolute joint's zero \[°\].
    pub zero_deg: f64,
    /// Error of the angle between neighbouring axes \[°\].
    pub twist_deg: f64,
    /// Error of the angle between the base and gravity, about each of two axes of the base \[°\]. A
    /// finished floor deviates by 4 mm over 1 m, and by more over the width of a base (DIN 18202,
    /// table 3).
    pub mounting_deg: f64,
    /// Error of the distances between neighbour axes, and of a prismatic joint's zero \[m\].
    pub length_m: f64,
    /// Relative error of a joint's position: a belt or a rope in place of a gear, or a wrong number
    /// of counts \[share\].
    pub position_scale: f64,
    /// Relative error of a known torque, such as that of a spring, and of its slope over the range
    /// of the joint \[share\].
    pub known_torque: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self {
            torque_gain: 0.01,
            torque_delay_s: 0.0002,
            zero_deg: 0.5,
            twist_deg: 0.1,
            mounting_deg: 0.5,
            length_m: 0.001,
            position_scale: 0.001,
            known_torque: 0.02,
        }
    }
}

impl Tolerances {
    /// Distance from a configured value beyond which the data contradict it, in standard
    /// deviations.
    pub(crate) const CONTRADICTION_DEVIATIONS: f64 = 3.0;

    /// Checks that each tolerance is finite and greater than 0, because no value is perfectly
    /// certain.
    ///
    /// # Errors
    /// [`ToleranceError`] with the first invalid tolerance.
    pub fn validate(&self) -> Result<(), ToleranceError> {
        for (name, value) in [
            ("torque_gain", self.torque_gain),
            ("torque_delay_s", self.torque_delay_s),
            ("zero_deg", self.zero_deg),
            ("twist_deg", self.twist_deg),
            ("mounting_deg", self.mounting_deg),
            ("length_m", self.length_m),
            ("position_scale", self.position_scale),
            ("known_torque", self.known_torque),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(ToleranceError { name, value });
            }
        }
        Ok(())
    }
}
