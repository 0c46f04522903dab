//! Requests to the archiver's thread, and its status.

use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use super::window::RecordedWindow;

/// Maximum number of waiting requests, separately for the queue and for those that wait for the
/// ring.
pub(super) const QUEUE_CAPACITY: usize = 16;

/// The archiver's status.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ArchiveStatus {
    /// Number of recordings kept in this run.
    #[serde(rename = "kept")]
    pub fixed: u64,
    /// Number of recordings that could not be kept in this run.
    pub failed: u64,
    /// Number of recordings that wait for the ring or the disk.
    pub waiting: u64,
    /// Reason for the last failure.
    pub last_failure: Option<String>,
    /// Number of faults whose frames were not kept, because other faults occurred shortly before.
    pub faults_passed_over: u64,
    /// Number of recordings in the folder.
    pub files: usize,
    /// Total size of the recordings in the folder \[bytes\].
    pub bytes: u64,
    /// Name of the running capture.
    pub capture: Option<String>,
}

/// Reason why a capture was not started or not stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CaptureError {
    /// A capture is running. Stop it first.
    #[error("the capture `{0}` is running; stop it first")]
    Running(String),
    /// No capture is running.
    #[error("no capture is running")]
    NotRunning,
    /// The name is not valid in a file name.
    #[error("a capture's name has 1 to 32 letters, digits, `_` or `-`")]
    Name,
    /// The ring contains no frames.
    #[error("nothing is recorded: {0}")]
    NothingRecorded(String),
    /// Too many requests are waiting. Try again later.
    #[error("the archiver is busy; try again")]
    Busy,
}

/// Checks that the name is a valid capture name. It becomes a part of a file name.
///
/// # Errors
/// [`CaptureError::Name`].
pub fn check_capture_name(name: &str) -> Result<(), CaptureError> {
    let fits = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-');
    let is_one = (1..=32).contains(&name.len()) && name.bytes().all(fits);
    if is_one { Ok(()) } else { Err(CaptureError::Name) }
}

pub(super) type CaptureAnswer = SyncSender<Result<(), CaptureError>>;

/// A request to the thread.
pub(super) enum Request {
    Result { number: u64, window: RecordedWindow },
    Fault { cause: &'static str, stamp_ns: u64 },
    Start { name: String, answer: CaptureAnswer },
    Stop { answer: CaptureAnswer },
}

/// The archiver's counts.
#[derive(Clone, Debug, Default)]
pub struct SharedArchive(pub(super) Arc<Mutex<ArchiveStatus>>);

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SharedArchive {
    /// Returns a copy of the counts.
    pub fn snapshot(&self) -> ArchiveStatus {
        lock(&self.0).clone()
    }

    pub(super) fn count_failure(&self, what: &str, why: &dyn core::fmt::Display) {
        tracing::warn!("no recording of {what}: {why}");
        let mut status = lock(&self.0);
        status.waiting = status.waiting.saturating_sub(1);
        status.failed += 1;
        status.last_failure = Some(format!("{what}: {why}"));
    }
}
