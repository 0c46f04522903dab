//! What the model takes for known and may be otherwise, and how much that would change.

use core::fmt;

use serde::{Serialize, Serializer};

/// A model that has what the fitted one takes for known. Joints and motors are numbered from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alternative {
    /// The shape of friction over speed at a joint.
    JointFriction(usize),
    /// The same at a motor that is geared to several joints.
    MotorFriction(usize),
    /// When the torques act, each joint's on its own.
    TorqueDelay,
    /// The torque gain of one joint against the others. A factor common to all is no alternative:
    /// it is in every parameter.
    TorqueGain(usize),
    /// The base parameters that are taken as 0.
    LeftOutParameters,
    /// What the position filter takes out of the motion.
    PositionFilter,
    /// What the noise of the positions adds to it.
    PositionNoise,
}

impl Alternative {
    /// What would be otherwise, wherever that is.
    pub(super) fn quantity(self) -> &'static str {
        match self {
            Self::JointFriction(_) | Self::MotorFriction(_) => "friction law",
            Self::TorqueDelay => "delay of the torques",
            Self::TorqueGain(_) => "torque gain",
            Self::LeftOutParameters => "parameters left out",
            Self::PositionFilter => "position filter",
            Self::PositionNoise => "noise of the positions",
        }
    }

    /// The joint or motor that it concerns, where it concerns one.
    pub(super) fn place(self) -> Option<String> {
        match self {
            Self::JointFriction(joint) | Self::TorqueGain(joint) => Some(format!("joint {joint}")),
            Self::MotorFriction(motor) => Some(format!("motor {motor}")),
            _ => None,
        }
    }
}

impl fmt::Display for Alternative {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.quantity())?;
        self.place().map_or(Ok(()), |place| write!(f, " of {place}"))
    }
}

impl Serialize for Alternative {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What one alternative model would change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelCheck {
    /// What the model would have.
    #[serde(rename = "freedom")]
    pub alternative: Alternative,
    /// The probability that a right model makes as much of this by chance; none where nothing is
    /// estimated.
    pub probability: Option<f64>,
    /// The parameter that would move furthest in its standard deviations, of those that would move
    /// by more than the alternative's own uncertainty if there are any.
    pub parameter: String,
    /// How far, in its corrected standard deviations, as the model has them now.
    pub shift_deviations: f64,
    /// How uncertain that is, in the same unit: one standard deviation; none where nothing is
    /// estimated.
    pub shift_uncertainty: Option<f64>,
}

/// When the torque of a joint acts, over what its timing says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TorqueDelay {
    /// Later than stated by this \[s\]; earlier where negative.
    pub delay_s: f64,
    /// Its corrected standard deviation \[s\].
    pub standard_deviation_s: f64,
}
