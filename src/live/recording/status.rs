//! The recorder's status.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

/// State of the recorder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecordingState {
    /// No frame has come yet.
    #[default]
    Waiting,
    /// It writes.
    Recording,
    /// It does not record. It tries again automatically.
    Failed,
    /// The bus has ended.
    Ended,
}

/// Recorder part of a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordingStatus {
    /// Its state.
    pub state: RecordingState,
    /// Reason of the last failure, with the remedy if there is one.
    pub why: Option<String>,
    /// Disk size of the ring \[bytes\].
    pub ring_bytes: u64,
    /// Maximum disk size of the ring \[bytes\].
    pub ring_limit_bytes: u64,
    /// Number of files in the ring.
    pub segments: usize,
    /// Time span back to the oldest frame of the ring \[s\].
    pub oldest_s: Option<f64>,
    /// Frames written.
    pub frames_recorded: u64,
    /// Number of frames that were not recorded: the disk was too slow, or failed.
    pub frames_unrecorded: u64,
    /// Number of failed writes.
    pub write_errors: u64,
    /// Number of ring files that were removed early because the disk was full.
    pub segments_given_way: u64,
    /// True if the disk has too little space for the complete ring, and the ring shrinks in favour
    /// of results.
    pub gives_way: bool,
    /// Number of files that an earlier run left unfinished, and that were closed.
    pub segments_repaired: u64,
}

/// Counts of the recorder, shared with the status. The bus thread accesses only the last number.
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
