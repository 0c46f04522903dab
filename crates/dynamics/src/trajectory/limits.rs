//! Limits of a joint.

use crate::robot::JointIndex;
use serde::{Deserialize, Serialize};

use super::TrajectoryError;

/// The limits of one joint that a reference respects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLimits {
    /// Lowest position \[rad\].
    pub position_min_rad: f64,
    /// Highest position \[rad\].
    pub position_max_rad: f64,
    /// Largest speed \[rad/s\].
    pub velocity_max_rad_s: f64,
    /// Largest acceleration and deceleration \[rad/s²\].
    pub acceleration_max_rad_s2: f64,
}

impl JointLimits {
    /// Checks the limits of a joint.
    pub(super) fn validate(&self, joint: JointIndex) -> Result<(), TrajectoryError> {
        let bad =
            |key, value, expected| Err(TrajectoryError::BadLimit { joint, key, value, expected });
        if !self.position_min_rad.is_finite() {
            return bad("position_min_rad", self.position_min_rad, "finite");
        }
        if !(self.position_max_rad.is_finite() && self.position_max_rad > self.position_min_rad) {
            return bad("position_max_rad", self.position_max_rad, "above position_min_rad");
        }
        for (key, value) in [
            ("velocity_max_rad_s", self.velocity_max_rad_s),
            ("acceleration_max_rad_s2", self.acceleration_max_rad_s2),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return bad(key, value, "finite and positive");
            }
        }
        Ok(())
    }

    /// True if the joint may stand at `position_rad`; never for NaN.
    pub fn contains(&self, position_rad: f64) -> bool {
        (self.position_min_rad..=self.position_max_rad).contains(&position_rad)
    }
}
