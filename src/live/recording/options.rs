//! Options of the recordings: `[service.recordings]` of the cell file.

use std::path::{Path, PathBuf};
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;

use super::budget::WriteBudget;
use super::output::{CreateOutput, create_file};

/// Recording options. Without the section nothing is recorded.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RecordingOptions {
    /// Another folder, as on another disk.
    ///
    /// If left out: `recordings` in `state_directory`.
    pub directory: Option<PathBuf>,
    /// The most that the ring takes on disk, the file being written included \[MB\]; 8 to 10 000
    /// 000.
    pub ring_mb: u64,
    /// A file of the ring is closed after this time, or at an eighth of the ring, at most 64 MB
    /// \[s\]; 1 to 3600.
    pub segment_s: f64,
    /// Kept before the first sample of a window \[s\]; 0.5 to 60.
    pub before_s: f64,
    /// Kept after the last sample of a window \[s\]; 0 to 60.
    pub after_s: f64,
    /// Kept before a fault \[s\]; 0 to 600. After it `after_s`.
    pub fault_before_s: f64,
    /// At most one recording of a fault in this time \[s\]; the others are counted; 1 to 86 400.
    pub fault_every_s: f64,
    /// Recordings kept of each kind: results, faults, captures; 1 to 100 000.
    pub keep: usize,
    /// The most that all of them take together \[MB\]; the oldest go; 8 to 10 000 000.
    pub keep_mb: u64,
    /// A capture is stopped after this time, or when it is half of the ring or of `keep_mb` \[s\];
    /// 1 to 86 400.
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

/// Number of bytes of a megabyte.
const MEGABYTE: u64 = 1_000_000;

impl RecordingOptions {
    /// Checks every value.
    ///
    /// Key and allowed values of the first invalid option.
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
        self.ring_mb.saturating_mul(MEGABYTE)
    }

    /// Returns the maximum size of the kept recordings \[bytes\].
    pub fn keep_bytes(&self) -> u64 {
        self.keep_mb.saturating_mul(MEGABYTE)
    }
}

/// Options of the recorder.
#[derive(Clone)]
pub struct RecorderOptions {
    /// Folder of the ring.
    pub folder: PathBuf,
    /// Maximum size of the ring \[bytes\].
    pub ring_bytes: u64,
    /// Maximum duration of a file.
    pub segment: Duration,
    /// Name of the cell.
    pub cell: String,
    /// Hash of its configuration.
    pub configuration: String,
    /// Function that creates files.
    pub create: CreateOutput,
    /// Budget for the ring.
    pub budget: WriteBudget,
}

/// Name of the file with the bytes that the recorder has written, next to the folder of the ring.
const WRITTEN_FILE: &str = ".written.json";

impl RecorderOptions {
    /// Returns the options with a budget of a day \[MB\].
    #[must_use]
    pub fn with_budget(mut self, megabytes: Option<u64>) -> Self {
        self.budget = WriteBudget::new(megabytes, &self.folder.with_file_name(WRITTEN_FILE));
        self
    }

    /// Creates the options for a cell whose recordings are in `folder`.
    pub fn new(options: &RecordingOptions, folder: &Path, cell: &str, configuration: &str) -> Self {
        Self {
            folder: ring_folder(folder),
            ring_bytes: options.ring_bytes(),
            segment: Duration::from_secs_f64(options.segment_s),
            cell: cell.to_owned(),
            configuration: configuration.to_owned(),
            create: std::sync::Arc::new(create_file),
            budget: WriteBudget::default(),
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
