//! Messages of a bag, from its files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use super::error::BagError;
use super::mcap::{self, FileEnd, McapFault, McapRecord};
#[cfg(feature = "sqlite")]
use super::sqlite::{self, SqliteFault, StoredMessage};
use crate::container::{SQLITE_MAGIC, begins_with, foreign_container};

pub(super) const JOINT_STATE: &str = "sensor_msgs/msg/JointState";

/// Returns true if a file is an SQLite database, whose only use here is a bag.
pub fn is_sqlite(path: &Path) -> bool {
    begins_with(path, SQLITE_MAGIC)
}

/// Returns the files of a bag: one, or those in its folder by their numbers (`drive_0.mcap`,
/// `drive_1.mcap`).
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>, BagError> {
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
    if !path.is_dir() {
        return Ok(files);
    }
    // rosbag2 compresses whole files (`--compression-mode file`).
    let compressed = files.iter().find(|file| is(file, "zstd")).cloned();
    files.retain(|file| is(file, "mcap") || is(file, "db3"));
    if let (Some(compressed), true) = (compressed, files.is_empty()) {
        return Ok(vec![compressed]);
    }
    let number = |file: &PathBuf| -> Option<u64> {
        file.file_stem()?.to_str()?.rsplit_once('_')?.1.parse().ok()
    };
    files.sort_by_key(|file| (number(file), file.clone()));
    // The files of a split bag are numbered from 0. A missing last file would be a loss that no
    // stamp shows.
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

pub(super) fn malformed_message(path: &Path, topic: &str, number: usize) -> BagError {
    BagError::Malformed { file: path.to_path_buf(), topic: topic.to_owned(), number }
}

/// A message of a bag, with its type and topic.
pub(super) struct Message<'a> {
    pub(super) kind: &'a str,
    pub(super) topic: &'a str,
    pub(super) log_ns: u64,
    pub(super) data: &'a [u8],
}

/// Passes every message of a file to `take`, and returns how the file ends.
pub(super) fn for_each_message(
    path: &Path,
    take: &mut impl FnMut(Message<'_>) -> Result<(), ReadingEnd>,
) -> Result<FileEnd, BagError> {
    let io = |source| BagError::Io { file: path.to_path_buf(), source };
    if is_sqlite(path) {
        return read_sqlite(path, take).map(|()| FileEnd::Finished);
    }
    if let Some(container) = foreign_container(path) {
        return Err(BagError::Container { file: path.to_path_buf(), container });
    }
    let file = BufReader::new(File::open(path).map_err(io)?);
    // Schemas by their id; types and topics by the id of their channel.
    let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
    let mut part = |part: McapRecord<'_>| -> Result<(), ReadingEnd> {
        match part {
            McapRecord::Schema { id, name } => {
                schemas.insert(id, name.to_owned());
            }
            McapRecord::Channel { id, schema, topic } => {
                let kind = schemas.get(&schema).cloned().unwrap_or_default();
                channels.insert(id, (kind, topic.to_owned()));
            }
            McapRecord::Message { channel, log_ns, data } => {
                let Some((kind, topic)) = channels.get(&channel) else { return Ok(()) };
                take(Message { kind, topic, log_ns, data })?;
            }
        }
        Ok(())
    };
    mcap::read(file, &mut part).map_err(|end| end.into_error(path))
}

#[cfg(feature = "sqlite")]
fn read_sqlite(
    path: &Path,
    take: &mut impl FnMut(Message<'_>) -> Result<(), ReadingEnd>,
) -> Result<(), BagError> {
    let mut pass = |StoredMessage { kind, topic, log_ns, data }: StoredMessage<'_>| {
        take(Message { kind, topic, log_ns, data })
    };
    sqlite::read(path, &mut pass).map_err(|end| end.into_error(path))
}

#[cfg(not(feature = "sqlite"))]
fn read_sqlite(
    path: &Path,
    _take: &mut impl FnMut(Message<'_>) -> Result<(), ReadingEnd>,
) -> Result<(), BagError> {
    Err(BagError::Sqlite { file: path.to_path_buf() })
}

/// Reason why reading of a file stops.
pub(super) enum ReadingEnd {
    Bag(Box<BagError>),
    #[cfg(feature = "sqlite")]
    Sqlite(SqliteFault),
    File(McapFault),
}

impl ReadingEnd {
    fn into_error(self, path: &Path) -> BagError {
        let file = path.to_path_buf();
        match self {
            Self::Bag(error) => *error,
            #[cfg(feature = "sqlite")]
            Self::Sqlite(SqliteFault(problem)) => BagError::Format { file, problem },
            Self::File(McapFault::Io(source)) => BagError::Io { file, source },
            Self::File(fault) => BagError::Format { file, problem: fault.to_string() },
        }
    }
}

#[cfg(feature = "sqlite")]
impl From<SqliteFault> for ReadingEnd {
    fn from(fault: SqliteFault) -> Self {
        Self::Sqlite(fault)
    }
}

impl From<McapFault> for ReadingEnd {
    fn from(fault: McapFault) -> Self {
        Self::File(fault)
    }
}

impl From<BagError> for ReadingEnd {
    fn from(error: BagError) -> Self {
        Self::Bag(Box::new(error))
    }
}

/// Returns times after the first one \[s\]; an earlier time is negative.
pub(super) fn after_first_s(times_ns: &[u64]) -> Vec<f64> {
    let first_ns = times_ns.first().copied().unwrap_or_default();
    #[expect(clippy::cast_precision_loss, reason = "differences to the first")]
    times_ns
        .iter()
        .map(|time_ns: &u64| {
            let distance_s = time_ns.abs_diff(first_ns) as f64 * 1e-9;
            if *time_ns < first_ns { -distance_s } else { distance_s }
        })
        .collect()
}
