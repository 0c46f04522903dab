//! What a bag has for an identification: its joint states and the arm's description.

use std::collections::BTreeMap;
use std::path::Path;

use super::cdr::{JointState, text};
use super::error::BagError;
use super::messages::{JOINT_STATE, Message, files, malformed, walk};
use crate::measurement::MAX_SAMPLES;

const TEXT: &str = "std_msgs/msg/String";
const ROBOT_DESCRIPTION: &str = "robot_description";

/// A topic of joint states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagTopic {
    /// Joints that its messages name, in the order of the first ones.
    pub joints: Vec<String>,
    /// Those of them that a message gives no finite effort.
    pub without_effort: Vec<String>,
    /// Messages.
    pub messages: usize,
    /// Messages a second by the stamps in them, from the median distance; none where they do not advance \[Hz\].
    pub header_hz: Option<f64>,
    /// The same by the times at which they were recorded \[Hz\].
    pub log_hz: Option<f64>,
}

/// What a bag has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagContents {
    /// Topics of joint states by their name.
    pub topics: BTreeMap<String, BagTopic>,
    /// The URDF that was published beside them.
    pub robot_description: Option<String>,
}

/// Looks through a bag, which may be the folder of a split one.
///
/// # Errors
/// [`BagError`].
pub fn list_bag(path: &Path) -> Result<BagContents, BagError> {
    let mut contents = BagContents::default();
    let mut times: BTreeMap<String, [Vec<u64>; 2]> = BTreeMap::new();
    for file in files(path)? {
        walk(&file, &mut |Message { kind, topic: name, log_ns, data }| {
            match kind {
                TEXT if name.ends_with(ROBOT_DESCRIPTION) => {
                    let found = text(data).map_err(|_| malformed(&file, name, 1))?;
                    contents.robot_description.get_or_insert(found);
                }
                JOINT_STATE => {
                    let topic = contents.topics.entry(name.to_owned()).or_default();
                    topic.messages += 1;
                    let state = JointState::read(data);
                    let state = state.map_err(|_| malformed(&file, name, topic.messages))?;
                    topic.see(&state);
                    let [header, log] = times.entry(name.to_owned()).or_default();
                    if header.len() < MAX_SAMPLES {
                        header.push(state.stamp_ns);
                        log.push(log_ns);
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
    }
    for (name, [header, log]) in times {
        if let Some(topic) = contents.topics.get_mut(&name) {
            (topic.header_hz, topic.log_hz) = (rate_hz(&header), rate_hz(&log));
        }
    }
    Ok(contents)
}

impl BagTopic {
    fn see(&mut self, state: &JointState) {
        for (k, name) in state.name.iter().enumerate() {
            if !self.joints.contains(name) {
                self.joints.push(name.clone());
            }
            let effort = state.effort.get(k).is_some_and(|effort| effort.is_finite());
            if !effort && !self.without_effort.contains(name) {
                self.without_effort.push(name.clone());
            }
        }
    }
}

/// By the median distance of times that advance.
fn rate_hz(times_ns: &[u64]) -> Option<f64> {
    let mut steps: Vec<u64> =
        times_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    steps.sort_unstable();
    #[expect(clippy::cast_precision_loss, reason = "a distance of messages")]
    let median_ns = *steps.get(steps.len() / 2)? as f64;
    (median_ns > 0.0).then(|| 1e9 / median_ns)
}
