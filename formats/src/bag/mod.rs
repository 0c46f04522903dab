//! ROS 2 bags: MCAP files with joint states.

mod cdr;
mod contents;
mod error;
mod mcap;
mod messages;
mod spec;

use std::collections::BTreeMap;
use std::path::Path;

pub use contents::{BagContents, BagTopic, list_bag};
use didim_core::identification::Signals;
pub use error::BagError;
pub use spec::{BagSpec, BagTime};

use crate::measurement::{MAX_SAMPLES, Measurement};
use crate::record::Record;
use crate::uniform::{Rows, TimesError, resample};
use cdr::JointState;
use messages::{JOINT_STATE, Message, after_first_s, files, malformed, walk};

/// Joints and topics that an error lists.
const LISTED: usize = 12;

/// What is seen of a topic.
#[derive(Default)]
struct Topic {
    joints: Vec<String>,
    messages: usize,
    times_ns: Vec<u64>,
    /// Positions, then efforts.
    columns: Vec<Vec<f64>>,
}

/// Reads the joint states of a bag at its rate, cut where messages are missing.
///
/// # Errors
/// [`BagError`].
pub fn read_bag(path: &Path, spec: &BagSpec) -> Result<Record, BagError> {
    let mut topics = BTreeMap::new();
    for file in files(path)? {
        read_file(&file, spec, &mut topics)?;
    }
    let (_, Topic { times_ns, columns, .. }) = choose(path, topics, spec)?;
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
    if spec.time == BagTime::Rows {
        let enough = times_ns.len() > 1;
        return enough.then(|| measurement(columns).into()).ok_or(wrong(TimesError::TooShort));
    }
    let rows = Rows { times_s: after_first_s(&times_ns), columns };
    Ok(Record::resampled(resample(rows, spec.rate_hz).map_err(wrong)?, measurement))
}

/// Takes every topic with joint states of a file.
fn read_file(
    path: &Path,
    spec: &BagSpec,
    topics: &mut BTreeMap<String, Topic>,
) -> Result<(), BagError> {
    walk(path, &mut |Message { kind, topic: name, log_ns, data }| {
        if kind != JOINT_STATE {
            return Ok(());
        }
        let topic = topics.entry(name.to_owned()).or_default();
        topic.messages += 1;
        let state = JointState::read(data);
        let state = state.map_err(|_| malformed(path, name, topic.messages))?;
        topic.take(path, state, log_ns, spec)?;
        Ok(())
    })
}

impl Topic {
    /// Takes a state of all joints; what another publisher says of others is passed over.
    fn take(
        &mut self,
        path: &Path,
        state: JointState,
        log_ns: u64,
        spec: &BagSpec,
    ) -> Result<(), BagError> {
        for name in &state.name {
            if self.joints.len() < LISTED && !self.joints.contains(name) {
                self.joints.push(name.clone());
            }
        }
        // Their order may change from one message to the next.
        let place = |joint: &String| state.name.iter().position(|name| name == joint);
        let Some(places) = spec.joints.iter().map(place).collect::<Option<Vec<usize>>>() else {
            return Ok(());
        };
        let time_ns = match spec.time {
            BagTime::Header => state.stamp_ns,
            BagTime::Log => log_ns,
            BagTime::Rows => self.times_ns.len() as u64,
        };
        if self.times_ns.len() == MAX_SAMPLES {
            return Err(BagError::TooLong { file: path.to_path_buf() });
        }
        self.columns.resize_with(2 * places.len(), Vec::new);
        let mut columns = self.columns.iter_mut();
        for (what, of) in [("position", &state.position), ("effort", &state.effort)] {
            for ((place, joint), column) in places.iter().zip(&spec.joints).zip(&mut columns) {
                let Some(value) = of.get(*place).copied().filter(|value| value.is_finite()) else {
                    #[expect(clippy::cast_precision_loss, reason = "for people")]
                    let time_s = time_ns as f64 * 1e-9;
                    let (file, joint) = (path.to_path_buf(), joint.clone());
                    return Err(BagError::Missing { file, joint, what, time_s });
                };
                column.push(value);
            }
        }
        self.times_ns.push(time_ns);
        Ok(())
    }
}

/// The topic that has the joints.
fn choose(
    path: &Path,
    topics: BTreeMap<String, Topic>,
    spec: &BagSpec,
) -> Result<(String, Topic), BagError> {
    let found: Vec<String> = (topics.iter())
        .map(|(name, topic)| format!("{name} ({})", topic.joints.join(" ")))
        .collect();
    let wanted = |name: &String| spec.topic.as_ref().is_none_or(|wanted| wanted == name);
    let mut fitting: Vec<(String, Topic)> = topics
        .into_iter()
        .filter(|(name, topic)| wanted(name) && !topic.times_ns.is_empty())
        .collect();
    let file = path.to_path_buf();
    match fitting.len() {
        0 => {
            let (wanted, none) = (spec.joints.join(" "), "no topic of joint states".to_owned());
            let found = if found.is_empty() { none } else { found.join(", ") };
            Err(BagError::NoTopic { file, wanted, found })
        }
        1 => Ok(fitting.remove(0)),
        _ => {
            let topics: Vec<String> = fitting.into_iter().map(|(name, _)| name).collect();
            Err(BagError::Topics { file, topics: topics.join(" ") })
        }
    }
}
