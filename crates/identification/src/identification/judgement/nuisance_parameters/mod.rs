//! Nuisance parameters: assumptions of the model that may be wrong, each with its prior size, its
//! torque and its estimate.

mod along;
mod columns;
mod list;

use core::fmt;

use didim_dynamics::robot::{JointIndex, MotorIndex};
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::stored_value::{self, Unit, number};

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
    /// Scale of a joint's position.
    PositionScale(JointIndex),
    /// Torque on a joint that depends on its position: of hoses, cables, a spring.
    PositionTorque(JointIndex),
    /// Angle between the base and gravity, about an axis of the base.
    Mounting(BaseAxis),
    /// Known torque on a joint: its size, and its slope over the joint's range.
    KnownTorque(JointIndex),
    /// Base parameters that are not identified.
    LeftOutParameters,
}

/// Axis of the frame of the base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaseAxis {
    /// The x axis.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    Z,
}

impl BaseAxis {
    /// All axes, in the order of the coordinates.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Returns a vector, in the frame of the base, turned about this axis.
    fn turn(self, vector: [f64; 3], angle_rad: f64) -> [f64; 3] {
        let place = self as usize;
        let [first, second] = [(place + 1) % 3, (place + 2) % 3];
        let (sin, cos) = angle_rad.sin_cos();
        let mut result = vector;
        result[first] = cos * vector[first] - sin * vector[second];
        result[second] = sin * vector[first] + cos * vector[second];
        result
    }
}

impl fmt::Display for BaseAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(["x", "y", "z"][*self as usize])
    }
}

impl NuisanceParameter {
    /// Returns true for a friction law.
    pub(super) fn is_friction(self) -> bool {
        matches!(self, Self::JointFriction(_) | Self::MotorFriction(_))
    }

    /// Returns true if no configured value stands for it, so that it is an error of the model.
    pub(super) fn is_model_error(self) -> bool {
        matches!(
            self,
            Self::JointFriction(_)
                | Self::MotorFriction(_)
                | Self::Coupling { .. }
                | Self::PositionTorque(_)
                | Self::LeftOutParameters
        )
    }

    /// Returns the version of the list that has this nuisance parameter first.
    fn list_version(self) -> usize {
        match self {
            Self::PositionScale(_) | Self::PositionTorque(_) => 2,
            Self::Mounting(_) => 1,
            _ => 0,
        }
    }

    /// Returns true if no error of the model leaves torques like this one, so that the data may
    /// contradict a value that they determine worse than its tolerance. Friction resembles a delay,
    /// for example.
    pub(super) fn is_distinct(self) -> bool {
        matches!(self, Self::PositionScale(_))
    }

    /// Returns true if other causes leave the same torques as this one, so that no data accuse it:
    /// a base that leans and a torque that depends on the position of joint 1, for example.
    pub(super) fn is_ambiguous(self) -> bool {
        matches!(self, Self::Mounting(_))
    }
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
            Self::PositionScale(joint) => write!(f, "position scale of joint {joint}"),
            Self::PositionTorque(joint) => write!(f, "position-dependent torque of joint {joint}"),
            Self::Mounting(axis) => write!(f, "mounting angle about the {axis} axis of the base"),
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

impl core::str::FromStr for NuisanceParameter {
    type Err = UnknownNuisanceParameter;

    /// Reads the text that [`Display`](fmt::Display) writes.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let unknown = || UnknownNuisanceParameter(text.to_owned());
        match text {
            "torque gain of all joints" => return Ok(Self::CommonGain),
            "parameters left out" => return Ok(Self::LeftOutParameters),
            _ => {}
        }
        if let Some((joint, neighbour)) =
            text.strip_prefix("coupling of joint ").and_then(|rest| rest.split_once(" to joint "))
        {
            let [joint, neighbour] =
                [joint, neighbour].map(|number| position(number).map(JointIndex::new));
            let (joint, neighbour) = joint.zip(neighbour).ok_or_else(unknown)?;
            return Ok(Self::Coupling { joint, neighbour });
        }
        let mounting = BaseAxis::ALL.map(Self::Mounting);
        if let Some(found) = mounting.into_iter().find(|of| of.to_string() == text) {
            return Ok(found);
        }
        let (words, number) = text.rsplit_once(' ').ok_or_else(unknown)?;
        let at = position(number).ok_or_else(unknown)?;
        let joint = JointIndex::new(at);
        Ok(match words {
            "friction law of joint" => Self::JointFriction(joint),
            "friction law of motor" => Self::MotorFriction(MotorIndex::new(at)),
            "torque gain of joint" => Self::TorqueGain(joint),
            "torque delay of joint" => Self::TorqueDelay(joint),
            "zero of joint" => Self::Zero(joint),
            "twist before joint" => Self::Twist(joint),
            "axis distance before joint" => Self::Distance(joint),
            "link offset of joint" => Self::Offset(joint),
            "position scale of joint" => Self::PositionScale(joint),
            "position-dependent torque of joint" => Self::PositionTorque(joint),
            "known torque on joint" => Self::KnownTorque(joint),
            _ => return Err(unknown()),
        })
    }
}

/// Returns the position of a number that counts from 1.
fn position(number: &str) -> Option<usize> {
    number.parse::<usize>().ok()?.checked_sub(1)
}

/// Name of a nuisance parameter that this version does not know.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no nuisance parameter of this version")]
pub struct UnknownNuisanceParameter(String);

impl<'de> Deserialize<'de> for NuisanceParameter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// Reads nuisance parameters, without those of another version.
pub(super) fn known_nuisance_parameters<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<NuisanceEstimate>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Entry {
        Estimate(NuisanceEstimate),
        Other(IgnoredAny),
    }

    let entries = Vec::<Entry>::deserialize(deserializer)?;
    let estimates = entries.into_iter().filter_map(|entry| match entry {
        Entry::Estimate(estimate) => Some(estimate),
        Entry::Other(_) => None,
    });
    Ok(estimates.collect())
}

/// Estimate of one nuisance parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NuisanceEstimate {
    /// The nuisance parameter.
    #[serde(rename = "freedom")]
    #[schemars(with = "String")]
    pub nuisance: NuisanceParameter,
    /// Root mean square of the torque that it causes along the motion \[N·m or N\], at the joint
    /// with the largest relative torque.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub torque_nm: f64,
    /// Joint with the largest relative torque.
    pub joint: JointIndex,
    /// The same torque, relative to the torque of that joint.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub relative_torque: f64,
    /// Probability that noise alone causes an estimate at least as large. Results of earlier
    /// versions lack it.
    #[serde(default = "stored_value::not_stored", deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub probability: f64,
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
            NuisanceParameter::KnownTorque(_) | NuisanceParameter::PositionScale(_) => {
                [1.0 + value, standard_deviation]
            }
            // If torques read too large by this share, the configured gain is too large.
            _ => {
                let factor = 1.0 / (1.0 + value);
                [factor, standard_deviation * factor * factor]
            }
        })
    }
}

/// Deviation of a quantity from its configured value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Quantity {
    /// Deviation according to the data alone, without the prior of this quantity and without those
    /// of the values that the data contradict more.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Its standard deviation.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub standard_deviation: f64,
    /// Tolerance of the configured value, one standard deviation.
    #[serde(rename = "stated")]
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub configured: f64,
    /// Unit: `deg`, `m`, `s`, or `1` for a share.
    #[serde(deserialize_with = "stored_value::unit")]
    pub unit: Unit,
}

impl Quantity {
    /// Returns the deviation in standard deviations of the data and of the configured value
    /// together.
    pub(super) fn contradiction(self) -> f64 {
        self.value / self.configured.hypot(self.standard_deviation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_laws_are_those_of_joints_and_motors() {
        let [joint, neighbour] = [0, 1].map(JointIndex::new);
        assert!(NuisanceParameter::JointFriction(joint).is_friction());
        assert!(NuisanceParameter::MotorFriction(MotorIndex::new(0)).is_friction());
        for other in [
            NuisanceParameter::Coupling { joint, neighbour },
            NuisanceParameter::TorqueGain(joint),
            NuisanceParameter::PositionTorque(joint),
            NuisanceParameter::LeftOutParameters,
        ] {
            assert!(!other.is_friction(), "{other:?}");
        }
    }
}
