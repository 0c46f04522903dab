//! ROS 2 bags: MCAP and SQLite files with joint states.

mod cdr;
mod contents;
mod error;
mod mcap;
mod messages;
mod spec;
#[cfg(feature = "sqlite")]
mod sqlite;
mod turns;

use std::collections::BTreeMap;
use std::path::Path;

pub use contents::{BagContents, BagTopic, list_bag};
use didim_dynamics::Signals;
pub use error::BagError;
pub use messages::is_sqlite;
pub use spec::{BagSpec, BagTime};

use crate::capacity::Capacity;
use crate::columns::unwrap_turns;
use crate::measurement::Measurement;
use crate::missing_values::MissingValues;
use crate::record::Record;
use crate::start::RecordingStart;
use crate::time_limits::TimeLimits;
use crate::uniform::{TimedRows, TimesError, resample};
use cdr::JointState;
use mcap::FileEnd;
use messages::{JOINT_STATE, Message, after_first_s, files, for_each_message, malformed_message};

/// Maximum number of joints and topics that an error lists.
const MAX_LISTED_NAMES: usize = 12;

/// Findings on a topic.
#[derive(Default)]
struct TopicContent {
    joints: Vec<String>,
    messages: usize,
    /// Number of messages with all requested joints.
    complete_messages: usize,
    /// Number of messages that miss a value and are left out.
    incomplete_messages: usize,
    /// Number of messages without any effort, and of changes between these and others.
    without_effort: usize,
    effort_changes: usize,
    has_efforts: Option<bool>,
    first_incomplete: Option<IncompleteRows>,
    times_ns: Vec<u64>,
    /// Positions, then efforts.
    columns: Vec<Vec<f64>>,
}

/// The first message that misses a value.
struct IncompleteRows {
    /// Its number among those with all joints, from 1.
    number: usize,
    /// `position` or `effort`.
    missing_field: &'static str,
    joint: String,
}

/// Reads the joint states of a bag at its rate, cut where messages or their values are missing.
///
/// # Errors
/// [`BagError`].
pub fn read_bag(path: &Path, spec: &BagSpec) -> Result<Record, BagError> {
    let mut topics = BTreeMap::new();
    let capacity = Capacity::of_values(2 * spec.joints.len());
    let mut truncated = None;
    for file in files(path)? {
        let end = read_file(&file, spec, capacity, &mut topics)?;
        truncated = truncated.or((end == FileEnd::Truncated).then_some(file));
    }
    let (name, topic) = choose_topic(path, topics, spec)?;
    if topic.alternates_without_effort() {
        return Err(BagError::AlternatingEfforts {
            file: path.into(),
            topic: name,
            without_effort: topic.without_effort,
            messages: topic.complete_messages,
        });
    }
    let TopicContent {
        times_ns,
        mut columns,
        complete_messages: complete,
        incomplete_messages: missing,
        first_incomplete: first,
        ..
    } = topic;
    let positions = &mut columns[..spec.joints.len()];
    for (position, wraps) in positions.iter_mut().zip(&spec.wraps) {
        if *wraps {
            unwrap_turns(position);
        }
    }
    if let Some((joint, jumps)) = turns::find_two_publishers(positions) {
        let (file, joint, messages) = (path.into(), spec.joints[joint].clone(), times_ns.len());
        return Err(BagError::TwoPublishers { file, topic: name, joint, jumps, messages });
    }
    let missing_values = first.map(|IncompleteRows { number, missing_field: what, joint }| {
        let first = format!("message {number}, {what} of joint {joint}");
        MissingValues { missing, total: complete, row_kind: "messages", first_missing: first }
    });
    let measurement = |columns: Vec<Vec<f64>>| {
        let mut position = columns;
        let mut torque = position.split_off(spec.joints.len());
        for (torque, scale) in torque.iter_mut().zip(&spec.torque_scales) {
            torque.iter_mut().for_each(|value| *value *= scale);
        }
        let signals = Signals {
            sample_rate_hz: spec.rate_hz,
            position_rad: position,
            torque_nm: torque,
            reference_rad: None,
        };
        Measurement { side: spec.side, rate_unchecked: spec.time == BagTime::Rows, signals }
    };
    let wrong = |source| BagError::Times { file: path.to_path_buf(), source };
    let mut times_s = after_first_s(&times_ns);
    if spec.time == BagTime::Rows {
        if missing_values.is_none() {
            let enough = times_ns.len() > 1;
            let record = enough.then(|| Record::from(measurement(columns)));
            let record = record.ok_or(wrong(TimesError::TooShort))?;
            return Ok(Record { truncated_file: truncated, ..record });
        }
        // In this mode the times are message numbers.
        times_s.iter_mut().for_each(|time| *time *= 1e9 / spec.rate_hz);
    }
    let rows = TimedRows { times_s, columns };
    let record = Record::from_uniform(resample(rows, spec.rate_hz).map_err(wrong)?, measurement);
    // Rows by arrival order have no time.
    let first_ns = times_ns.first().filter(|_| spec.time != BagTime::Rows);
    let start = first_ns.and_then(|first_ns| RecordingStart::of_unix_ns((*first_ns).into()));
    let (truncated_file, recording_start) = (truncated, start);
    Ok(Record { missing_values, recording_start, truncated_file, ..record })
}

/// Reads every topic with joint states of a file.
fn read_file(
    path: &Path,
    spec: &BagSpec,
    capacity: Capacity,
    topics: &mut BTreeMap<String, TopicContent>,
) -> Result<FileEnd, BagError> {
    for_each_message(path, &mut |Message { kind, topic: name, log_ns, data }| {
        if kind != JOINT_STATE {
            return Ok(());
        }
        let topic = topics.entry(name.to_owned()).or_default();
        topic.messages += 1;
        let state = JointState::read(data);
        let state = state.map_err(|_| malformed_message(path, name, topic.messages))?;
        topic.add_state(path, state, log_ns, spec, capacity)?;
        Ok(())
    })
}

impl TopicContent {
    /// Returns true if messages with efforts and messages without any alternate, as those of two
    /// publishers do.
    fn alternates_without_effort(&self) -> bool {
        let least = TimeLimits::DEFAULT.alternating_messages;
        self.effort_changes >= self.complete_messages.div_ceil(least)
            && self.effort_changes >= least
    }

    /// Adds a state of all requested joints; states of other joints are skipped.
    fn add_state(
        &mut self,
        path: &Path,
        state: JointState,
        log_ns: u64,
        spec: &BagSpec,
        capacity: Capacity,
    ) -> Result<(), BagError> {
        for name in &state.name {
            if self.joints.len() < MAX_LISTED_NAMES && !self.joints.contains(name) {
                self.joints.push(name.clone());
            }
        }
        // The order of the joints may change from one message to the next.
        let place = |joint: &String| state.name.iter().position(|name| name == joint);
        let Some(places) = spec.joints.iter().map(place).collect::<Option<Vec<usize>>>() else {
            return Ok(());
        };
        self.complete_messages += 1;
        let has_efforts = !state.effort.is_empty();
        self.without_effort += usize::from(!has_efforts);
        let before = self.has_efforts.replace(has_efforts);
        self.effort_changes += usize::from(before.is_some_and(|before| before != has_efforts));
        let time_ns = match spec.time {
            BagTime::Header => state.stamp_ns,
            BagTime::Log => log_ns,
            BagTime::Rows => self.complete_messages as u64,
        };
        if self.times_ns.len() == capacity.samples {
            return Err(BagError::TooLong { file: path.to_path_buf(), samples: capacity.samples });
        }
        let mut row = Vec::with_capacity(2 * places.len());
        for (what, of) in [("position", &state.position), ("effort", &state.effort)] {
            for (place, joint) in places.iter().zip(&spec.joints) {
                let Some(value) = of.get(*place).copied().filter(|value| value.is_finite()) else {
                    self.incomplete_messages += 1;
                    let number = self.complete_messages;
                    self.first_incomplete.get_or_insert_with(|| IncompleteRows {
                        number,
                        missing_field: what,
                        joint: joint.clone(),
                    });
                    return Ok(());
                };
                row.push(value);
            }
        }
        self.columns.resize_with(row.len(), Vec::new);
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        self.times_ns.push(time_ns);
        Ok(())
    }
}

/// Returns the topic that has the joints.
fn choose_topic(
    path: &Path,
    topics: BTreeMap<String, TopicContent>,
    spec: &BagSpec,
) -> Result<(String, TopicContent), BagError> {
    let topics_found: Vec<String> = (topics.iter())
        .map(|(name, topic)| format!("{name} ({})", topic.joints.join(" ")))
        .collect();
    let wanted = |name: &String| spec.topic.as_ref().is_none_or(|wanted| wanted == name);
    let (mut fitting, others): (Vec<(String, TopicContent)>, Vec<_>) = (topics.into_iter())
        .filter(|(name, _)| wanted(name))
        .partition(|(_, topic)| !topic.times_ns.is_empty());
    let file = path.to_path_buf();
    let missing = others.into_iter().find_map(
        |(name, TopicContent { complete_messages: complete, first_incomplete: first, .. })| {
            first.map(|first| (name, complete, first))
        },
    );
    match fitting.len() {
        0 if let Some((topic, messages, IncompleteRows { missing_field: what, joint, .. })) =
            missing =>
        {
            Err(BagError::Missing { file, topic, messages, joint, what })
        }
        0 => {
            let (wanted, none) = (spec.joints.join(" "), "no topic of joint states".to_owned());
            let topics_found = if topics_found.is_empty() { none } else { topics_found.join(", ") };
            Err(BagError::NoTopic { file, wanted, found: topics_found })
        }
        1 => Ok(fitting.remove(0)),
        _ => {
            let topics: Vec<String> = fitting.into_iter().map(|(name, _)| name).collect();
            Err(BagError::Topics { file, topics: topics.join(" ") })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Side;

    #[test]
    fn a_bag_for_which_there_is_no_room_is_refused_with_how_much_there_is() {
        let spec = BagSpec {
            joints: vec!["a".to_owned()],
            topic: None,
            rate_hz: 100.0,
            side: Side::Joint,
            torque_scales: vec![1.0],
            wraps: Vec::new(),
            time: BagTime::Log,
        };
        let mut topic = TopicContent::default();
        let mut take = |log_ns| {
            let (name, one) = (vec!["a".to_owned()], vec![1.0]);
            let state = JointState { stamp_ns: 0, name, position: one.clone(), effort: one };
            topic.add_state(Path::new("x.mcap"), state, log_ns, &spec, Capacity { samples: 2 })
        };
        take(0).unwrap();
        take(10).unwrap();
        let refused = take(20).unwrap_err().to_string();
        assert!(refused.starts_with("x.mcap: more than 2 samples, for which memory"), "{refused}");
    }
}
