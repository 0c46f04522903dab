//! Nuisance parameters: assumptions of the model that may be wrong, each with its prior size, its
//! torque and its estimate.

mod along;
mod columns;
mod list;

use core::fmt;

use didim_dynamics::robot::{JointIndex, MotorIndex};
use serde::{Serialize, Serializer};

pub(super) use along::NuisanceObservation;
pub(super) use columns::NuisanceColumns;
pub(super) use list::Observed;

/// Assumption of the model that may be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NuisanceParameter {
    /// Shape of a joint's friction over speed.
    JointFriction(JointIndex),
    /// Shape of friction over speed of a motor that is geared to several joints.
    MotorFriction(MotorIndex),
    /// Friction and inertia torques on a joint due to the motion of a neighbouring joint.
    Coupling {
        /// Joint on which the torques act.
        joint: JointIndex,
        /// Neighbouring joint that moves.
        neighbour: JointIndex,
    },
    /// Torque gain of one joint.
    TorqueGain(JointIndex),
    /// Torque gain common to all joints.
    CommonGain,
    /// Delay of a joint's torque.
    TorqueDelay(JointIndex),
    /// Zero error of a joint's position.
    Zero(JointIndex),
    /// Angle between the axes of a joint and the previous joint.
    Twist(JointIndex),
    /// Distance between these axes, along their common normal.
    Distance(JointIndex),
    /// Offset of a joint's link along its axis.
    Offset(JointIndex),
    /// Known torque on a joint: its size, and its slope over the joint's range.
    KnownTorque(JointIndex),
    /// Base parameters that are not identified.
    LeftOutParameters,
}

impl fmt::Display for NuisanceParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointFriction(joint) => write!(f, "friction law of joint {joint}"),
            Self::MotorFriction(motor) => write!(f, "friction law of motor {motor}"),
            Self::Coupling { joint, neighbour } => {
                write!(f, "coupling of joint {joint} to joint {neighbour}")
            }
            Self::TorqueGain(joint) => write!(f, "torque gain of joint {joint}"),
            Self::CommonGain => f.write_str("torque gain of all joints"),
            Self::TorqueDelay(joint) => write!(f, "torque delay of joint {joint}"),
            Self::Zero(joint) => write!(f, "zero of joint {joint}"),
            Self::Twist(joint) => write!(f, "twist before joint {joint}"),
            Self::Distance(joint) => write!(f, "axis distance before joint {joint}"),
            Self::Offset(joint) => write!(f, "link offset of joint {joint}"),
            Self::KnownTorque(joint) => write!(f, "known torque on joint {joint}"),
            Self::LeftOutParameters => f.write_str("parameters left out"),
        }
    }
}

impl Serialize for NuisanceParameter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Estimate of one nuisance parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NuisanceEstimate {
    /// The nuisance parameter.
    #[serde(rename = "freedom")]
    pub nuisance: NuisanceParameter,
    /// Root mean square of the torque that it causes along the motion \[N·m or N\], at the joint
    /// with the largest relative torque.
    pub torque_nm: f64,
    /// Joint with the largest relative torque.
    pub joint: JointIndex,
    /// The same torque, relative to the torque of that joint.
    pub relative_torque: f64,
    /// Deviation of the configured quantity, if the nuisance parameter has one and the data
    /// identify it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantity: Option<Quantity>,
}

impl NuisanceEstimate {
    /// True if the nuisance parameter is the delay of a torque.
    pub(super) fn is_delay(&self) -> bool {
        matches!(self.nuisance, NuisanceParameter::TorqueDelay(_))
    }

    /// Returns the factor by which the configured value has to be multiplied, and its standard
    /// deviation. Returns `None` if the quantity has another unit or is not identified.
    pub fn correction_factor(&self) -> Option<[f64; 2]> {
        let Quantity { value, standard_deviation, unit, .. } = self.quantity?;
        (unit == "1").then(|| match self.nuisance {
            NuisanceParameter::KnownTorque(_) => [1.0 + value, standard_deviation],
            // If torques read too large by this share, the configured gain is too large.
            _ => {
                let factor = 1.0 / (1.0 + value);
                [factor, standard_deviation * factor * factor]
            }
        })
    }
}

/// Deviation of a quantity from its configured value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// Deviation according to the data alone, without the prior of this quantity.
    pub value: f64,
    /// Its standard deviation.
    pub standard_deviation: f64,
    /// Tolerance of the configured value, one standard deviation.
    #[serde(rename = "stated")]
    pub configured: f64,
    /// Unit: `deg`, `m`, `s`, or `1` for a share.
    pub unit: &'static str,
}
