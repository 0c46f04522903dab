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
    /// The shape of friction over speed at a joint.
    JointFriction(JointIndex),
    /// The same at a motor that is geared to several joints.
    MotorFriction(MotorIndex),
    /// Friction and inertia that act on a joint as its neighbour moves.
    Coupling {
        /// The joint on which they act.
        joint: JointIndex,
        /// The joint that moves.
        neighbour: JointIndex,
    },
    /// The torque gain of one joint.
    TorqueGain(JointIndex),
    /// A torque gain common to all joints.
    CommonGain,
    /// When the torque of a joint acts.
    TorqueDelay(JointIndex),
    /// The zero of a joint's position.
    Zero(JointIndex),
    /// The angle between the axes of a joint and the one before.
    Twist(JointIndex),
    /// The distance between these axes, along their common normal.
    Distance(JointIndex),
    /// The offset of a joint's link along its axis.
    Offset(JointIndex),
    /// The known torque on a joint: its size, and how it grows over the joint's range.
    KnownTorque(JointIndex),
    /// The base parameters that are not identified.
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
    /// Root mean square of the torque that it causes along the motion, at the joint where that is
    /// largest relative to the joint's own \[N·m or N\].
    pub torque_nm: f64,
    /// That joint.
    pub joint: JointIndex,
    /// The same torque relative to the joint's own.
    pub relative_torque: f64,
    /// The quantity itself, if the nuisance parameter is one and the data identify it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantity: Option<Quantity>,
}

impl NuisanceEstimate {
    /// Returns the factor by which the configured value has to be multiplied, with its standard
    /// deviation, if the data give one.
    pub fn correction_factor(&self) -> Option<[f64; 2]> {
        let Quantity { value, standard_deviation, unit, .. } = self.quantity?;
        (unit == "1").then(|| match self.nuisance {
            NuisanceParameter::KnownTorque(_) => [1.0 + value, standard_deviation],
            // Torques that read too large by this share have a gain that is configured too large.
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
    /// The deviation as the data alone give it, without the prior of this quantity.
    pub value: f64,
    /// Its standard deviation.
    pub standard_deviation: f64,
    /// The configured standard deviation, its tolerance.
    #[serde(rename = "stated")]
    pub configured: f64,
    /// `deg`, `m`, `s`, or `1` for a share.
    pub unit: &'static str,
}
