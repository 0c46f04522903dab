//! Content of the recorded torques: the joints that have one, and the terms that it contains.

use core::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::index::JointIndex;

/// A term that recorded torques may lack, because the controller or the driver subtracted it.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum TorqueTerm {
    /// The torque against gravity.
    Gravity,
    /// Friction of joints and motors.
    Friction,
}

impl fmt::Display for TorqueTerm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gravity => "gravity",
            Self::Friction => "friction",
        })
    }
}

/// Content of the recorded torques. By default every joint has a torque, with all terms.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedTorque {
    /// Joints without a recorded torque, ascending.
    pub(super) missing_joints: Vec<JointIndex>,
    /// Terms that the torques do not contain, ascending.
    pub(super) excluded_terms: Vec<TorqueTerm>,
    /// Gravity of the robot file, if the torques do not contain it \[m/s²\].
    pub(super) configured_gravity_m_s2: Option<[f64; 3]>,
}

impl RecordedTorque {
    /// Returns the joints without a recorded torque, ascending.
    pub fn missing_joints(&self) -> &[JointIndex] {
        &self.missing_joints
    }

    /// Returns the terms that the torques do not contain, ascending.
    pub fn excluded_terms(&self) -> &[TorqueTerm] {
        &self.excluded_terms
    }

    /// Returns true if the torque of a joint is recorded.
    pub fn has_joint(&self, joint: JointIndex) -> bool {
        !self.missing_joints.contains(&joint)
    }

    /// Returns true if every joint has a torque, with all terms.
    pub fn is_complete(&self) -> bool {
        self.missing_joints.is_empty() && self.excluded_terms.is_empty()
    }
}
