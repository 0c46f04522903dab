//! What a bag has for an identification: its joint states and the arm's description.

use std::collections::BTreeMap;
use std::path::Path;

use super::cdr::{JointState, text};
use super::error::BagError;
use super::messages::{JOINT_STATE, Message, after_first_s, files, malformed, walk};
use crate::uniform::mean_rate_hz;

/// Stamps of a topic by which its rate is told.
const STAMPS: usize = 1 << 20;
const TEXT: &str = "std_msgs/msg/String";
const ROBOT_DESCRIPTION: &str = "robot_description";

/// Joint states of a topic that name the same joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagTopic {
    /// Its name.
    pub name: String,
    /// Joints that these messages name, sorted: of a topic with several publishers there is one entry for each of their sets.
    pub joints: Vec<String>,
    /// Those of them that no message gives a finite effort.
    pub without_effort: Vec<String>,
    /// Messages.
    pub messages: usize,
    /// Messages a second by the stamps in them, from the mean distance; none where they do not advance \[Hz\].
    pub header_hz: Option<f64>,
    /// The same by the times at which they were recorded \[Hz\].
    pub log_hz: Option<f64>,
}

/// What a bag has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagContents {
    /// Joint states.
    pub topics: Vec<BagTopic>,
    /// The URDF that was published beside them.
    pub robot_description: Option<String>,
}

/// What was seen of a topic, the joints with an effort, and the stamps and times of recording of its messages.
type Seen = (BagTopic, Vec<String>, [Vec<u64>; 2]);

/// Looks through a bag, which may be the folder of a split one.
///
/// # Errors
/// [`BagError`].
pub fn list_bag(path: &Path) -> Result<BagContents, BagError> {
    let mut contents = BagContents::default();
    // By topic and joints: what was seen, and the times.
    let mut found: BTreeMap<(String, Vec<String>), Seen> = BTreeMap::new();
    let mut messages = 0;
    for file in files(path)? {
        walk(&file, &mut |Message { kind, topic: name, log_ns, data }| {
            match kind {
                TEXT if name.ends_with(ROBOT_DESCRIPTION) => {
                    let found = text(data).map_err(|_| malformed(&file, name, 1))?;
                    contents.robot_description.get_or_insert(found);
                }
                JOINT_STATE => {
                    messages += 1;
                    let state = JointState::read(data);
                    let state = state.map_err(|_| malformed(&file, name, messages))?;
                    let mut joints = state.name.clone();
                    joints.sort_unstable();
                    let (topic, with_effort, [header, log]) =
                        found.entry((name.to_owned(), joints)).or_default();
                    topic.messages += 1;
                    for (joint, effort) in state.name.iter().zip(&state.effort) {
                        if effort.is_finite() && !with_effort.contains(joint) {
                            with_effort.push(joint.clone());
                        }
                    }
                    if header.len() < STAMPS {
                        header.push(state.stamp_ns);
                        log.push(log_ns);
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
    }
    for ((name, joints), (topic, with_effort, [header, log])) in found {
        let [header_hz, log_hz] = [header, log].map(|times| mean_rate_hz(&after_first_s(&times)));
        let without = joints.iter().filter(|joint| !with_effort.contains(joint));
        let without_effort = without.cloned().collect();
        let topic = BagTopic { name, joints, without_effort, header_hz, log_hz, ..topic };
        contents.topics.push(topic);
    }
    Ok(contents)
}
