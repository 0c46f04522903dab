//! What a worker is started with, and why it may end.

use std::path::PathBuf;

use super::options::{WindowOptionError, WindowPlan};
use super::time_of_day::TimeOfDay;
use crate::archive::drift::DriftOptions;
use crate::archive::store::{ConfigurationTexts, StoreError};
use crate::live::recording::{ArchiverOptions, RecordedWindow};
use crate::live::stream::{StreamError, StreamOptions};

/// What to do with a window when the queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WhenBusy {
    /// Reject it: the bus does not wait.
    Reject,
    /// Wait: the log does.
    Wait,
}

/// What the worker needs.
#[derive(Clone, Debug)]
pub struct WorkerOptions {
    /// The stream.
    pub stream: StreamOptions,
    /// What time of day its stamps tell.
    pub time_of_day: TimeOfDay,
    /// The windows.
    pub windows: WindowPlan,
    /// Windows that may wait while one is identified. Memory: (queue + 2) windows.
    pub queue: usize,
    /// Folder of the results; nothing: they are published only.
    pub folder: Option<PathBuf>,
    /// Results kept in the folder.
    pub keep: usize,
    /// Hash of the configuration, for the results.
    pub configuration: String,
    /// The window of a recording that is replayed: it is identified, and no other.
    pub recorded: Option<RecordedWindow>,
    /// Where recordings are kept; nothing keeps none.
    pub archiver: Option<ArchiverOptions>,
    /// What is stored beside the results.
    pub results: ResultOptions,
}

/// Why the worker ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The options of the windows are invalid.
    #[error(transparent)]
    Windows(#[from] WindowOptionError),
    /// The stream failed.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The results' folder failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The system gives no thread.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// The identification's thread panicked; its message is in the log. Report it.
    #[error("the identification ended by itself: see the log above")]
    IdentificationEnded,
}

/// What is stored beside the results, so that they can be reproduced and compared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultOptions {
    /// The files of the configuration as they were read.
    pub texts: ConfigurationTexts,
    /// Hash of how the base parameters are made up, for the history.
    pub regrouping: String,
    /// What counts as drift from the baseline.
    pub drift: DriftOptions,
}
