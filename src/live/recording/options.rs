//! `[service.recordings]`

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;

use super::output::{CreateOutput, create_file};

/// Recording options. Without the section nothing is recorded.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecordingOptions {
    /// Folder; `recordings` in the state folder if omitted.
    pub directory: Option<PathBuf>,
    /// Maximum disk size of the ring, including the file being written \[MB = 10⁶ bytes\].
    pub ring_mb: u64,
    /// Duration after which a file of the ring is closed \[s\]. It is also closed at an eighth of
    /// the ring.
    pub segment_s: f64,
    /// Time kept before a window's first sample \[s\], 0.5 at least: the cycle grid of a replay
    /// settles in it.
    pub before_s: f64,
    /// Time kept after a window's last sample \[s\].
    pub after_s: f64,
    /// Time kept before a fault \[s\].
    pub fault_before_s: f64,
    /// Minimum time between two recordings of faults \[s\].
    pub fault_every_s: f64,
    /// Number of kept recordings of each kind: results, faults, captures.
    pub keep: usize,
    /// Maximum disk size of all kept recordings \[MB\].
    pub keep_mb: u64,
    /// Duration after which a capture is stopped \[s\]. It is also stopped when it is half of the
    /// ring.
    pub capture_max_s: f64,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self {
            directory: None,
            ring_mb: 1_000,
            segment_s: 60.0,
            before_s: 2.0,
            after_s: 1.0,
            fault_before_s: 10.0,
            fault_every_s: 60.0,
            keep: 50,
            keep_mb: 1_000,
            capture_max_s: 600.0,
        }
    }
}

/// Bytes of a megabyte.
const MB: u64 = 1_000_000;

impl RecordingOptions {
    /// Checks every value.
    ///
    /// # Errors
    /// The key and the allowed values.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let megabytes = [
            ("service.recordings.ring_mb", self.ring_mb),
            ("service.recordings.keep_mb", self.keep_mb),
        ];
        for (key, value) in megabytes {
            if !(8..=10_000_000).contains(&value) {
                return Err((key, format!("{value} is not in 8..=10000000")));
            }
        }
        let seconds = [
            ("service.recordings.segment_s", self.segment_s, 1.0, 3600.0),
            ("service.recordings.before_s", self.before_s, 0.5, 60.0),
            ("service.recordings.after_s", self.after_s, 0.0, 60.0),
            ("service.recordings.fault_before_s", self.fault_before_s, 0.0, 600.0),
            ("service.recordings.fault_every_s", self.fault_every_s, 1.0, 86_400.0),
            ("service.recordings.capture_max_s", self.capture_max_s, 1.0, 86_400.0),
        ];
        for (key, value, low, high) in seconds {
            if !(low..=high).contains(&value) {
                return Err((key, format!("{value} s is not in {low}..={high}")));
            }
        }
        if !(1..=100_000).contains(&self.keep) {
            let problem = format!("{} is not in 1..=100000", self.keep);
            return Err(("service.recordings.keep", problem));
        }
        Ok(())
    }

    /// Returns the folder of all recordings.
    pub fn folder(&self, state: &Path) -> PathBuf {
        self.directory.clone().unwrap_or_else(|| state.join("recordings"))
    }

    /// Returns the maximum size of the ring \[bytes\].
    pub fn ring_bytes(&self) -> u64 {
        self.ring_mb.saturating_mul(MB)
    }

    /// Returns the maximum size of the kept recordings \[bytes\].
    pub fn keep_bytes(&self) -> u64 {
        self.keep_mb.saturating_mul(MB)
    }
}

/// Options of the recorder.
#[derive(Clone)]
pub struct RecorderOptions {
    /// Folder of the ring.
    pub folder: PathBuf,
    /// Maximum size of the ring \[bytes\].
    pub ring_bytes: u64,
    /// Duration after which a file is closed.
    pub segment: Duration,
    /// Name of the cell.
    pub cell: String,
    /// Hash of its configuration.
    pub configuration: String,
    /// Function that creates files.
    pub create: CreateOutput,
}

impl RecorderOptions {
    /// Creates the options for a cell whose recordings are in `folder`.
    pub fn new(options: &RecordingOptions, folder: &Path, cell: &str, configuration: &str) -> Self {
        Self {
            folder: ring_folder(folder),
            ring_bytes: options.ring_bytes(),
            segment: Duration::from_secs_f64(options.segment_s),
            cell: cell.to_owned(),
            configuration: configuration.to_owned(),
            create: std::sync::Arc::new(create_file),
        }
    }
}

impl core::fmt::Debug for RecorderOptions {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("RecorderOptions").field("folder", &self.folder).finish_non_exhaustive()
    }
}

/// Returns the subfolders of the folder of all recordings.
pub fn recording_folders(folder: &Path) -> [PathBuf; 2] {
    [ring_folder(folder), archive_folder(folder)]
}

/// Returns the ring folder within the folder of all recordings.
pub(super) fn ring_folder(folder: &Path) -> PathBuf {
    folder.join("ring")
}

/// Returns the folder of the kept recordings within the folder of all recordings.
pub(super) fn archive_folder(folder: &Path) -> PathBuf {
    folder.join("kept")
}
