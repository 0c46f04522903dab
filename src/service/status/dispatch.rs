//! Routing of requests to the parts that execute them.

use core::time::Duration;

use tokio::sync::{mpsc, oneshot};

use super::request::Request;
use crate::live::recording::CaptureError;
use crate::live::worker::{Command, Commands, SubmitError};

/// Maximum response time of the worker.
const WORKER_TIMEOUT: Duration = Duration::from_secs(1);
/// Maximum duration of a reload. It is shorter than the timeout of a client, so that the client
/// gets the answer.
const RELOAD_TIMEOUT: Duration = Duration::from_secs(4);
/// Maximum number of waiting reloads.
const MAX_WAITING_RELOADS: usize = 4;

/// Handles of the parts that execute requests. A handle is `None` if this process does not have the
/// part.
#[derive(Clone, Debug, Default)]
pub struct Dispatcher {
    /// The worker, for windows and captures.
    pub windows: Option<Commands>,
    /// The supervision, for the configuration.
    pub reload: Option<ReloadSender>,
}

/// Reason why a request was not executed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DispatchError {
    /// This process does not have the part that executes the request. Send the request to the other
    /// process.
    #[error("this process {0}")]
    NotHere(&'static str),
    /// The worker did not execute the request.
    #[error(transparent)]
    Worker(#[from] SubmitError),
    /// A capture cannot be started or stopped.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The baseline was not changed.
    #[error("{0}")]
    Baseline(String),
    /// The new configuration was refused. The previous one stays active.
    #[error("{0}")]
    Reload(String),
    /// The executing part is busy, or the service ends. Try again later.
    #[error("the service is busy: try again")]
    Busy,
}

impl Dispatcher {
    /// Executes a request within a limited time, and returns a description of the action.
    ///
    /// # Errors
    /// [`DispatchError`].
    pub async fn dispatch(&self, request: Request) -> Result<String, DispatchError> {
        match request {
            Request::Window(command) => {
                let submit = move |worker: &Commands| worker.submit(command, WORKER_TIMEOUT);
                self.on_worker("has no windows", submit).await??;
                let done = match command {
                    Command::Begin => "a window opens with the next sample",
                    Command::End => "the window is closed once it has its margin, and identified",
                    Command::Identify => "the window is closed and will be identified",
                };
                Ok(done.to_owned())
            }
            Request::Capture(request) => {
                let submit = move |worker: &Commands| request.submit(worker);
                Ok(self.on_worker("keeps no recordings", submit).await??)
            }
            Request::Note(note) => {
                self.on_worker("has no windows", move |worker| worker.add_note(note)).await?;
                Ok("noted with the window that is open, or the next one".to_owned())
            }
            Request::Baseline(request) => {
                let submit = move |worker: &Commands| request.submit(worker);
                let done = self.on_worker("has no results", submit).await?;
                done.map_err(|why| DispatchError::Baseline(why.to_string()))
            }
            Request::Reload => {
                let reload = self.reload.as_ref();
                reload.ok_or(DispatchError::NotHere("has no file to reload"))?.reload().await?;
                Ok("the new configuration holds from the next window on".to_owned())
            }
        }
    }

    /// Sends a request to the worker from a thread that may block. The worker answers between two
    /// batches.
    async fn on_worker<T: Send + 'static>(
        &self,
        without: &'static str,
        ask: impl FnOnce(&Commands) -> T + Send + 'static,
    ) -> Result<T, DispatchError> {
        let worker = self.windows.clone().ok_or(DispatchError::NotHere(without))?;
        tokio::task::spawn_blocking(move || ask(&worker)).await.map_err(|_| DispatchError::Busy)
    }
}

/// Channel for the outcome of a reload, to the requester.
pub type ReloadAnswer = oneshot::Sender<Result<(), String>>;

/// Sender of reload requests to the supervision.
#[derive(Clone, Debug)]
pub struct ReloadSender(mpsc::Sender<ReloadAnswer>);

impl ReloadSender {
    /// Creates the sender, and the receiver for the supervision.
    pub fn channel() -> (Self, mpsc::Receiver<ReloadAnswer>) {
        let (sender, receiver) = mpsc::channel(MAX_WAITING_RELOADS);
        (Self(sender), receiver)
    }

    async fn reload(&self) -> Result<(), DispatchError> {
        let (answer, answered) = oneshot::channel();
        self.0.try_send(answer).map_err(|_| DispatchError::Busy)?;
        let answered = tokio::time::timeout(RELOAD_TIMEOUT, answered).await;
        let outcome =
            answered.map_err(|_| DispatchError::Busy)?.map_err(|_| DispatchError::Busy)?;
        outcome.map_err(DispatchError::Reload)
    }
}
