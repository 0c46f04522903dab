//! ROS 2 bags: MCAP files with joint states.

mod cdr;
mod contents;
mod error;
mod mcap;
mod spec;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

pub use contents::{BagContents, BagTopic, list_bag};
use didim_core::identification::Signals;
pub use error::BagError;
pub use spec::{BagSpec, BagTime};

use crate::measurement::{MAX_SAMPLES, Measurement};
use crate::record::Record;
use crate::uniform::{Rows, TimesError, resample};
use cdr::JointState;
use mcap::{Fault, Part};

const JOINT_STATE: &str = "sensor_msgs/msg/JointState";
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
    let first_ns = times_ns.first().copied().unwrap_or_default();
    // Before the first is back, and said so.
    #[expect(clippy::cast_precision_loss, reason = "differences to the first")]
    let after = |time_ns: &u64| {
        let apart = time_ns.abs_diff(first_ns) as f64 * 1e-9;
        if *time_ns < first_ns { -apart } else { apart }
    };
    let rows = Rows { times_s: times_ns.iter().map(after).collect(), columns };
    Ok(Record::resampled(resample(rows, spec.rate_hz).map_err(wrong)?, measurement))
}

/// The files of a bag: one, or those in its folder by their numbers (`drive_0.mcap`, `drive_1.mcap`).
fn files(path: &Path) -> Result<Vec<PathBuf>, BagError> {
    let io = |source| BagError::Io { file: path.to_path_buf(), source };
    let is = |file: &Path, extension: &str| {
        file.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension))
    };
    let mut files = vec![path.to_path_buf()];
    if path.is_dir() {
        let entries = std::fs::read_dir(path).map_err(io)?;
        files = entries
            .map(|entry| entry.map(|entry| entry.path()))
            .collect::<Result<_, _>>()
            .map_err(io)?;
    }
    if let Some(file) = files.iter().find(|file| is(file, "db3")) {
        return Err(BagError::Sqlite { file: file.clone() });
    }
    if !path.is_dir() {
        return Ok(files);
    }
    files.retain(|file| is(file, "mcap"));
    let number = |file: &PathBuf| -> Option<u64> {
        file.file_stem()?.to_str()?.rsplit_once('_')?.1.parse().ok()
    };
    files.sort_by_key(|file| (number(file), file.clone()));
    // Split bags count from 0: one that is missing is a loss that no stamp shows at the end.
    for (expected, file) in (0..).zip(&files).filter(|_| files.len() > 1) {
        if number(file) != Some(expected) {
            return Err(BagError::FileMissing { folder: path.to_path_buf(), expected });
        }
    }
    if files.is_empty() {
        return Err(BagError::NoFile { folder: path.to_path_buf() });
    }
    Ok(files)
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

fn malformed(path: &Path, topic: &str, number: usize) -> BagError {
    BagError::Malformed { file: path.to_path_buf(), topic: topic.to_owned(), number }
}

/// A message of a bag, with its type and topic.
struct Message<'a> {
    kind: &'a str,
    topic: &'a str,
    log_ns: u64,
    data: &'a [u8],
}

/// Hands every message of a file to `take`.
fn walk(
    path: &Path,
    take: &mut impl FnMut(Message<'_>) -> Result<(), Stop>,
) -> Result<(), BagError> {
    let file = File::open(path);
    let file = file.map_err(|source| BagError::Io { file: path.to_path_buf(), source })?;
    // Schemas by their number; types and topics by that of their channel.
    let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
    let mut part = |part: Part<'_>| -> Result<(), Stop> {
        match part {
            Part::Schema { id, name } => {
                schemas.insert(id, name.to_owned());
            }
            Part::Channel { id, schema, topic } => {
                let kind = schemas.get(&schema).cloned().unwrap_or_default();
                channels.insert(id, (kind, topic.to_owned()));
            }
            Part::Message { channel, log_ns, data } => {
                let Some((kind, topic)) = channels.get(&channel) else { return Ok(()) };
                take(Message { kind, topic, log_ns, data })?;
            }
        }
        Ok(())
    };
    mcap::read(BufReader::new(file), &mut part).map_err(|stop| match stop {
        Stop::Bag(error) => *error,
        Stop::File(Fault::Io(source)) => BagError::Io { file: path.to_path_buf(), source },
        Stop::File(fault) => {
            BagError::Format { file: path.to_path_buf(), problem: fault.to_string() }
        }
    })
}

/// Why a file is not read further.
enum Stop {
    Bag(Box<BagError>),
    File(Fault),
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Self {
        Self::File(fault)
    }
}

impl From<BagError> for Stop {
    fn from(error: BagError) -> Self {
        Self::Bag(Box::new(error))
    }
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
