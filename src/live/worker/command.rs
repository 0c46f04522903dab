//! Commands to a running worker.

use core::time::Duration;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};

use super::configuration::Configuration;
use super::state::SharedEstimation;
use super::windower::CommandError;
use crate::live::recording::Archiver;
use crate::window::Note;

/// A command concerning the windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Open one.
    Begin,
    /// Close it.
    End,
    /// Close it at once, whatever opened it, and identify it.
    Identify,
}

pub(super) type Answer = Result<(), CommandError>;
/// A command, and where the answer goes.
pub(super) type Request = (Asked, SyncSender<Answer>);

pub(super) enum Asked {
    Command(Command),
    Configure(Box<Configuration>),
}

/// Hands commands to the worker.
#[derive(Clone, Debug)]
pub struct Commands {
    requests: SyncSender<Request>,
    shared: SharedEstimation,
    archiver: Option<Archiver>,
    /// Folder of the results.
    folder: Option<PathBuf>,
}

/// The worker did not take a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// Too many wait, or it has ended: ask again later.
    #[error("the worker is busy: try again")]
    Unavailable,
    /// The command does not fit the state.
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

    /// Takes captures; nothing where nothing is recorded.
    pub fn archiver(&self) -> Option<&Archiver> {
        self.archiver.as_ref()
    }

    /// The folder of the results, if they are stored.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Notes something with the open window, or with the next one. What was noted before and no
    /// window took is amended.
    pub fn note(&self, note: Note) {
        let mut status = self.shared.update();
        status.note = Some(status.note.take().unwrap_or_default().amended(note));
    }

    /// Hands over a command and waits for the answer, at most `timeout`.
    ///
    /// # Errors
    /// [`SubmitError`].
    pub fn submit(&self, command: Command, timeout: Duration) -> Result<(), SubmitError> {
        self.ask(Asked::Command(command), timeout)
    }

    /// Hands over another configuration, likewise. It is valid from the next window on; one that is
    /// open, or waits, keeps the one that it began with.
    ///
    /// # Errors
    /// [`SubmitError::Unavailable`].
    pub fn configure(
        &self,
        configuration: Configuration,
        timeout: Duration,
    ) -> Result<(), SubmitError> {
        self.ask(Asked::Configure(Box::new(configuration)), timeout)
    }

    fn ask(&self, asked: Asked, timeout: Duration) -> Result<(), SubmitError> {
        let (answer, answered) = sync_channel(1);
        self.requests.try_send((asked, answer)).map_err(|_| SubmitError::Unavailable)?;
        Ok(answered.recv_timeout(timeout).map_err(|_| SubmitError::Unavailable)??)
    }
}
