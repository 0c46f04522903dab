//! From a request to whoever does it.

use core::time::Duration;

use tokio::sync::{mpsc, oneshot};

use super::request::Request;
use crate::live::recording::CaptureError;
use crate::live::worker::{Command, Commands, SubmitError};

/// How long the worker may take.
const WORKER_TIMEOUT: Duration = Duration::from_secs(1);
/// How long a reload may take: less than a client waits, so that it is told.
const RELOAD_TIMEOUT: Duration = Duration::from_secs(4);
/// Reloads that may wait.
const RELOADS: usize = 4;

/// The handles of those who do what is asked; nothing where this process has none.
#[derive(Clone, Debug, Default)]
pub struct Dispatcher {
    /// Windows and captures: the worker.
    pub windows: Option<Commands>,
    /// The configuration: the supervision.
    pub reload: Option<ReloadSender>,
}

/// Why a request was not done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DispatchError {
    /// Nobody in this process does it: ask the process that has that part.
    #[error("this process {0}")]
    NotHere(&'static str),
    /// The worker did not.
    #[error(transparent)]
    Worker(#[from] SubmitError),
    /// A capture cannot begin or end.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The baseline stays as it is.
    #[error("{0}")]
    Baseline(String),
    /// The new configuration is not used; the one before goes on.
    #[error("{0}")]
    Reload(String),
    /// Whoever does it is busy, or the service ends: ask again later.
    #[error("the service is busy: try again")]
    Busy,
}

impl Dispatcher {
    /// Has a request done, in a bounded time, and says what is done.
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
                self.on_worker("has no windows", move |worker| worker.note(note)).await?;
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

    /// Asks the worker, which answers between two batches, from a thread that may wait.
    async fn on_worker<T: Send + 'static>(
        &self,
        without: &'static str,
        ask: impl FnOnce(&Commands) -> T + Send + 'static,
    ) -> Result<T, DispatchError> {
        let worker = self.windows.clone().ok_or(DispatchError::NotHere(without))?;
        tokio::task::spawn_blocking(move || ask(&worker)).await.map_err(|_| DispatchError::Busy)
    }
}

/// Who asks for a reload, to be told what came of it.
pub type ReloadAnswer = oneshot::Sender<Result<(), String>>;

/// Asks the supervision to read the configuration again.
#[derive(Clone, Debug)]
pub struct ReloadSender(mpsc::Sender<ReloadAnswer>);

impl ReloadSender {
    /// With the end at which the supervision hears of it.
    pub fn channel() -> (Self, mpsc::Receiver<ReloadAnswer>) {
        let (sender, receiver) = mpsc::channel(RELOADS);
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
