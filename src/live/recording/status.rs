//! The recorder's status.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

/// What the recorder does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecordingState {
    /// No frame has come yet.
    #[default]
    Waiting,
    /// It writes.
    Recording,
    /// It does not; it tries again by itself.
    Failed,
    /// The bus has ended.
    Ended,
}

/// The recorder in a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordingStatus {
    /// What it does.
    pub state: RecordingState,
    /// Why it last failed, with the remedy where there is one.
    pub why: Option<String>,
    /// What the ring takes on disk \[bytes\].
    pub ring_bytes: u64,
    /// The most that it may take \[bytes\].
    pub ring_limit_bytes: u64,
    /// Files of the ring.
    pub segments: usize,
    /// How far the ring goes back \[s\].
    pub oldest_s: Option<f64>,
    /// Frames written.
    pub frames_recorded: u64,
    /// Frames that were not: the disk was too slow, or failed.
    pub frames_unrecorded: u64,
    /// Times that writing failed.
    pub write_errors: u64,
    /// Files of the ring that were removed before their time, for want of room on the disk.
    pub segments_given_way: u64,
    /// The disk has no room for the whole ring, and the ring gives way to results.
    pub gives_way: bool,
    /// Files that an earlier run left unfinished, and that were closed.
    pub segments_repaired: u64,
}

/// The recorder's counts, shared with the status. The bus thread has the last number only.
#[derive(Clone, Debug, Default)]
pub struct SharedRecording {
    pub(super) status: Arc<Mutex<RecordingStatus>>,
    pub(super) unrecorded: Arc<AtomicU64>,
}

impl SharedRecording {
    /// A copy of the counts.
    pub fn snapshot(&self) -> RecordingStatus {
        let mut status = self.update().clone();
        status.frames_unrecorded = self.unrecorded.load(Ordering::Relaxed);
        status
    }

    pub(super) fn update(&self) -> MutexGuard<'_, RecordingStatus> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
