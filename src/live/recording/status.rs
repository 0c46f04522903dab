//! The recorder's status.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use super::budget::WriteStatus;

/// State of the recorder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecordingState {
    /// No frame has arrived yet.
    #[default]
    Waiting,
    /// The recorder writes frames.
    Recording,
    /// The recorder does not write after a failure, and tries again automatically.
    Failed,
    /// The bus has ended.
    Ended,
}

/// Recorder part of a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordingStatus {
    /// State of the recorder.
    pub state: RecordingState,
    /// Reason for the last failure, with the remedy if there is one.
    pub why: Option<String>,
    /// Size of the ring on disk \[bytes\].
    pub ring_bytes: u64,
    /// Maximum size of the ring on disk \[bytes\].
    pub ring_limit_bytes: u64,
    /// Number of files in the ring.
    pub segments: usize,
    /// Age of the oldest frame in the ring \[s\].
    pub oldest_s: Option<f64>,
    /// Number of frames written.
    pub frames_recorded: u64,
    /// Number of frames that were not recorded because the disk was too slow or failed.
    pub frames_unrecorded: u64,
    /// Number of failed writes.
    pub write_errors: u64,
    /// Number of ring files that were removed early because the disk was full.
    pub segments_given_way: u64,
    /// True if the disk has too little space for the complete ring, so that the ring is smaller
    /// than configured to leave space for results.
    pub gives_way: bool,
    /// Number of unfinished files of an earlier run that were repaired.
    pub segments_repaired: u64,
    /// Bytes written to the ring, and the budget.
    pub written: WriteStatus,
}

/// Counts of the recorder, shared with the status. The bus thread accesses only `unrecorded`.
#[derive(Clone, Debug, Default)]
pub struct SharedRecording {
    pub(super) status: Arc<Mutex<RecordingStatus>>,
    pub(super) unrecorded: Arc<AtomicU64>,
}

impl SharedRecording {
    /// Returns a copy of the counts.
    pub fn snapshot(&self) -> RecordingStatus {
        let mut status = self.update().clone();
        status.frames_unrecorded = self.unrecorded.load(Ordering::Relaxed);
        status
    }

    pub(super) fn update(&self) -> MutexGuard<'_, RecordingStatus> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
