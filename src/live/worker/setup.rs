//! Options for the start of a worker, and its errors.

use std::path::PathBuf;
use std::time::Duration;

use super::time_of_day::TimeOfDay;
use crate::archive::ResultOptions;
use crate::archive::store::StoreError;
use crate::live::recording::{ArchiverOptions, RecordedWindow, WriteBudget};
use crate::live::stream::{StreamError, StreamOptions};
use crate::live::window_options::{WindowOptionError, WindowPlan};

/// Handling of a window when the queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WhenBusy {
    /// Rejects the window, because the bus does not wait.
    Reject,
    /// Waits for a place, because the log waits as well.
    Wait,
}

/// Options of the worker.
#[derive(Clone, Debug)]
pub struct WorkerOptions {
    /// Options of the stream.
    pub stream: StreamOptions,
    /// Relation between the stamps of the stream and the time of day.
    pub time_of_day: TimeOfDay,
    /// Options of the windows.
    pub windows: WindowPlan,
    /// Number of windows that may wait while one is identified. The memory of (`queue` + 2) windows
    /// is needed.
    pub queue: usize,
    /// Folder of the results. If `None`, results are published but not stored.
    pub folder: Option<PathBuf>,
    /// Maximum time of an identification. It cannot be ended, so the worker ends after it.
    pub time_limit: Duration,
    /// Number of results kept in the folder.
    pub max_results: usize,
    /// Hash of the configuration, for the results.
    pub configuration: String,
    /// Window of a replayed recording. If set, only this window is identified.
    pub recorded: Option<RecordedWindow>,
    /// Options of the archiver. If `None`, no recordings are kept.
    pub archiver: Option<ArchiverOptions>,
    /// Data stored with the results.
    pub results: ResultOptions,
    /// Budget for results and kept recordings.
    pub budget: WriteBudget,
}

/// Error that ends the worker early.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The window options are invalid.
    #[error(transparent)]
    Windows(#[from] WindowOptionError),
    /// The stream failed.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The results folder failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The system cannot start a thread.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// The identification thread panicked. Its message is in the log. Report it.
    #[error("the identification ended by itself: see the log above")]
    IdentificationEnded,
    /// An identification cannot be ended, and holds up those of the next windows, so that only a
    /// new start helps. Keep a recording of such a window, and report it.
    #[error(
        "the identification of window {window} took longer than {limit_s} s; \
         start the service again"
    )]
    TimeLimit {
        /// Number of the window.
        window: u64,
        /// Maximum time \[s\].
        limit_s: f64,
    },
}
