//! Contents of a bag that an identification needs: its joint states and the arm's description.

use std::collections::BTreeMap;
use std::path::Path;

use super::cdr::{JointState, text};
use super::error::BagError;
use super::messages::{
    JOINT_STATE, Message, after_first_s, files, for_each_message, malformed_message,
};
use crate::row_times::mean_rate_hz;

/// Maximum number of stamps from which the rate of a topic is estimated.
const MAX_RATE_STAMPS: usize = 1 << 20;
const STRING_TYPE: &str = "std_msgs/msg/String";
const ROBOT_DESCRIPTION: &str = "robot_description";

/// Joint states of a topic that name the same joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagTopic {
    /// Its name.
    pub name: String,
    /// Joints that these messages name, sorted. A topic with several publishers has one entry for
    /// each of their sets.
    pub joints: Vec<String>,
    /// Joints whose effort is not finite in any message.
    pub without_effort: Vec<String>,
    /// Number of messages.
    pub messages: usize,
    /// Messages per second by the mean distance of their stamps \[Hz\]; `None` if the stamps do not
    /// advance.
    pub header_hz: Option<f64>,
    /// The same by their recording times \[Hz\].
    pub log_hz: Option<f64>,
}

/// Contents of a bag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagContents {
    /// Joint states.
    pub topics: Vec<BagTopic>,
    /// The URDF that was published with them.
    pub robot_description: Option<String>,
}

/// Findings on a topic: the joints with an effort, and the stamps and recording times of its
/// messages.
type Seen = (BagTopic, Vec<String>, [Vec<u64>; 2]);

/// Lists the contents of a bag, which may be the folder of a split one.
///
/// # Errors
/// [`BagError`].
pub fn list_bag(path: &Path) -> Result<BagContents, BagError> {
    let mut contents = BagContents::default();
    // Findings and times, by topic and joints.
    let mut topics: BTreeMap<(String, Vec<String>), Seen> = BTreeMap::new();
    let mut messages = 0;
    for file in files(path)? {
        for_each_message(&file, &mut |Message { kind, topic: name, log_ns, data }| {
            match kind {
                STRING_TYPE if name.ends_with(ROBOT_DESCRIPTION) => {
                    let description = text(data).map_err(|_| malformed_message(&file, name, 1))?;
                    contents.robot_description.get_or_insert(description);
                }
                JOINT_STATE => {
                    messages += 1;
                    let state = JointState::read(data);
                    let state = state.map_err(|_| malformed_message(&file, name, messages))?;
                    let mut joints = state.name.clone();
                    joints.sort_unstable();
                    let (topic, with_effort, [header, log]) =
                        topics.entry((name.to_owned(), joints)).or_default();
                    topic.messages += 1;
                    for (joint, effort) in state.name.iter().zip(&state.effort) {
                        if effort.is_finite() && !with_effort.contains(joint) {
                            with_effort.push(joint.clone());
                        }
                    }
                    if header.len() < MAX_RATE_STAMPS {
                        header.push(state.stamp_ns);
                        log.push(log_ns);
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
    }
    for ((name, joints), (topic, with_effort, [header, log])) in topics {
        let [header_hz, log_hz] = [header, log].map(|times| mean_rate_hz(&after_first_s(&times)));
        let without = joints.iter().filter(|joint| !with_effort.contains(joint));
        let without_effort = without.cloned().collect();
        let topic = BagTopic { name, joints, without_effort, header_hz, log_hz, ..topic };
        contents.topics.push(topic);
    }
    Ok(contents)
}
