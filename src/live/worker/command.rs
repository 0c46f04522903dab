//! Commands to a running worker.

use core::time::Duration;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};

use super::configuration::Configuration;
use super::state::SharedEstimation;
use super::windower::CommandError;
use crate::live::recording::Archiver;
use crate::window::Note;

/// A command for the windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Opens a window.
    Begin,
    /// Closes the open window.
    End,
    /// Closes the open window immediately and identifies it, whichever trigger opened it.
    Identify,
}

pub(super) type Answer = Result<(), CommandError>;
/// A command, and the channel for the answer.
pub(super) type Request = (WorkerRequest, SyncSender<Answer>);

pub(super) enum WorkerRequest {
    Command(Command),
    Configure(Box<Configuration>),
}

/// Sender of commands to the worker.
#[derive(Clone, Debug)]
pub struct Commands {
    requests: SyncSender<Request>,
    shared: SharedEstimation,
    archiver: Option<Archiver>,
    /// Folder of the results. `None` if they are not stored.
    folder: Option<PathBuf>,
}

/// Error when submitting a command to the worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// Too many commands are waiting, or the worker has ended. Try again later.
    #[error("the worker is busy: try again")]
    Unavailable,
    /// The command does not match the state of the windows.
    #[error(transparent)]
    Refused(#[from] CommandError),
}

impl Commands {
    pub(super) fn new(
        requests: SyncSender<Request>,
        shared: SharedEstimation,
        archiver: Option<Archiver>,
        folder: Option<PathBuf>,
    ) -> Self {
        Self { requests, shared, archiver, folder }
    }

    /// Returns the archiver, which executes captures. `None` if nothing is recorded.
    pub fn archiver(&self) -> Option<&Archiver> {
        self.archiver.as_ref()
    }

    /// Returns the folder of the results, if they are stored.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Adds a note to the open window, or else to the next one. The note amends an earlier note
    /// that no window has taken yet.
    pub fn add_note(&self, note: Note) {
        let mut status = self.shared.update();
        status.note = Some(status.note.take().unwrap_or_default().amend(note));
    }

    /// Submits a command and waits for the answer, for at most `timeout`.
    ///
    /// # Errors
    /// [`SubmitError`].
    pub fn submit(&self, command: Command, timeout: Duration) -> Result<(), SubmitError> {
        self.send_and_wait(WorkerRequest::Command(command), timeout)
    }

    /// Submits another configuration and waits for the answer, for at most `timeout`. It applies
    /// from the next window on. A window that is open or queued keeps its configuration.
    ///
    /// # Errors
    /// [`SubmitError::Unavailable`].
    pub fn configure(
        &self,
        configuration: Configuration,
        timeout: Duration,
    ) -> Result<(), SubmitError> {
        self.send_and_wait(WorkerRequest::Configure(Box::new(configuration)), timeout)
    }

    fn send_and_wait(&self, asked: WorkerRequest, timeout: Duration) -> Result<(), SubmitError> {
        let (answer, answered) = sync_channel(1);
        self.requests.try_send((asked, answer)).map_err(|_| SubmitError::Unavailable)?;
        Ok(answered.recv_timeout(timeout).map_err(|_| SubmitError::Unavailable)??)
    }
}
