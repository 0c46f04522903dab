//! Joints whose torque is used, as numbers or names.

use core::convert::Infallible;
use core::str::FromStr;

use didim_dynamics::dynamics::BaseParametersError;
use didim_dynamics::robot::{JointIndex, Robot};
use schemars::JsonSchema;
use serde::Deserialize;

/// A joint, as a user names it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "joints, by their numbers from 1 or their names")]
pub enum JointReference {
    /// Its number, counted from 1.
    Number(usize),
    /// Its name in the robot file or URDF.
    Name(String),
}

impl FromStr for JointReference {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let text = text.trim();
        Ok(text.parse().map_or_else(|_| Self::Name(text.to_owned()), Self::Number))
    }
}

impl JointReference {
    fn find(&self, robot: &Robot) -> Result<JointIndex, TorqueJointsError> {
        let mut all = (0..robot.joints()).map(JointIndex::new);
        let found = match self {
            Self::Number(number) => all.find(|joint| joint.number() == *number),
            Self::Name(name) => all.find(|joint| robot.joint_name(*joint) == Some(name)),
        };
        found.ok_or_else(|| {
            let joint = match self {
                Self::Number(number) => number.to_string(),
                Self::Name(name) => name.clone(),
            };
            let all = (0..robot.joints()).map(JointIndex::new);
            TorqueJointsError::Unknown {
                joint,
                available: all.map(|joint| robot.joint_label(joint)).collect::<Vec<_>>().join(", "),
            }
        })
    }

    /// Returns the joints of a list.
    ///
    /// # Errors
    /// [`TorqueJointsError`].
    pub(super) fn find_all(
        list: &[Self],
        robot: &Robot,
    ) -> Result<Vec<JointIndex>, TorqueJointsError> {
        if list.is_empty() {
            return Err(TorqueJointsError::Empty);
        }
        let mut joints: Vec<JointIndex> = Vec::with_capacity(list.len());
        for reference in list {
            let joint = reference.find(robot)?;
            if joints.contains(&joint) {
                return Err(TorqueJointsError::Repeated { joint: robot.joint_label(joint) });
            }
            joints.push(joint);
        }
        Ok(joints)
    }
}

/// Error of a list of joints. Correct the list.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TorqueJointsError {
    /// The list is empty.
    #[error("names no joint; leave it out to use every joint")]
    Empty,
    /// The arm has no such joint.
    #[error("`{joint}` is no joint of the arm; these are: {available}")]
    Unknown {
        /// The joint as written.
        joint: String,
        /// The joints of the arm.
        available: String,
    },
    /// A joint is listed more than once.
    #[error("joint {joint} is listed more than once; list it once")]
    Repeated {
        /// The joint.
        joint: String,
    },
    /// The base parameters cannot be found.
    #[error(transparent)]
    Base(#[from] BaseParametersError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_found_by_number_and_by_name() {
        let text = include_str!("../../config/robots/tx40.toml");
        let text = text.replacen("[[joint]]", "[[joint]]\nname = \"waist\"", 1);
        let robot = Robot::from_toml(&text).unwrap();
        let find = |list: &[&str]| {
            let list: Vec<JointReference> = list.iter().map(|of| of.parse().unwrap()).collect();
            JointReference::find_all(&list, &robot)
        };
        assert_eq!(find(&["3", " waist"]), Ok([2, 0].map(JointIndex::new).to_vec()));
        assert_eq!(find(&[]), Err(TorqueJointsError::Empty));
        assert!(matches!(find(&["1", "waist"]), Err(TorqueJointsError::Repeated { .. })));
        for unknown in ["0", "7", "elbow"] {
            let message = find(&[unknown]).unwrap_err().to_string();
            assert!(message.contains(unknown) && message.contains("1 (waist)"), "{message}");
        }
    }
}
