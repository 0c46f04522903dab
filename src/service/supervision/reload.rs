//! Reload of the configuration of a running service: on SIGHUP, or on request.

use core::future::pending;
use core::time::Duration;
use std::panic::{AssertUnwindSafe, catch_unwind};

use tokio::sync::mpsc::Receiver;
use tokio::task::JoinHandle;

use crate::live::worker::{Commands, Configuration};
use crate::service::status::ReloadAnswer;

/// Maximum time for the worker to accept a configuration.
const WORKER_TIMEOUT: Duration = Duration::from_secs(2);

/// Function that reads the configuration again, and checks that it can be used without a restart.
/// Returns the configuration that the worker uses from its next window on. `None` without a worker.
/// Returns an error with the reason of a refusal.
pub type Reload = Box<dyn FnMut() -> Result<Option<Configuration>, String> + Send>;

type Outcome = Result<(), String>;

/// Handler of reloads. It runs one at a time, outside the thread that answers requests and notifies
/// the watchdog.
pub(super) struct Reloader {
    reload: Option<Reload>,
    commands: Option<Commands>,
    reload_requests: Receiver<ReloadAnswer>,
    running_reload: Option<JoinHandle<(Reload, Outcome)>>,
    /// Channel to the requester of the running reload.
    requester: Option<ReloadAnswer>,
    /// True if a signal arrived during a reload. That reload may have read the files before the
    /// change that the signal announces.
    signal_pending: bool,
}

/// Next event to handle.
pub(super) enum Event {
    /// A reload is requested.
    Asked(ReloadAnswer),
    /// A reload has ended.
    Finished(Outcome),
}

impl Reloader {
    pub(super) fn new(
        reload: Option<Reload>,
        commands: Option<Commands>,
        asked: Receiver<ReloadAnswer>,
    ) -> Self {
        Self {
            reload,
            commands,
            reload_requests: asked,
            running_reload: None,
            requester: None,
            signal_pending: false,
        }
    }

    /// Waits for a request, or for the end of the running reload. The future can be dropped without
    /// losing an event.
    pub(super) async fn next(&mut self) -> Event {
        match &mut self.running_reload {
            Some(running) => {
                let ended = running.await;
                self.running_reload = None;
                Event::Finished(match ended {
                    Ok((reload, outcome)) => {
                        self.reload = Some(reload);
                        outcome
                    }
                    // The runtime is ending.
                    Err(_) => Err(panic_text()),
                })
            }
            None => match self.reload_requests.recv().await {
                Some(answer) => Event::Asked(answer),
                None => pending().await,
            },
        }
    }

    /// Starts a reload. Returns false if the reload has to wait for the end of the running one, or
    /// if reloads are not possible.
    pub(super) fn begin(&mut self, answer: Option<ReloadAnswer>) -> bool {
        if self.running_reload.is_some() {
            self.signal_pending = true;
            return false;
        }
        let Some(mut reload) = self.reload.take() else {
            notify(answer, &Err("there is no file to reload".to_owned()));
            return false;
        };
        self.requester = answer;
        let commands = self.commands.clone();
        self.running_reload = Some(tokio::task::spawn_blocking(move || {
            // The reload function can be called again after a panic.
            let read = catch_unwind(AssertUnwindSafe(&mut reload));
            let read = read.unwrap_or_else(|_| Err(panic_text()));
            let outcome = read.and_then(|configuration| match (configuration, commands) {
                (Some(configuration), Some(commands)) => commands
                    .configure(configuration, WORKER_TIMEOUT)
                    .map_err(|error| error.to_string()),
                _ => Ok(()),
            });
            (reload, outcome)
        }));
        true
    }

    /// Sends the outcome to the requester. Returns true if another reload has to follow.
    pub(super) fn finish(&mut self, outcome: &Outcome) -> bool {
        notify(self.requester.take(), outcome);
        core::mem::take(&mut self.signal_pending)
    }
}

fn panic_text() -> String {
    "reading it panicked: see the log before this".to_owned()
}

fn notify(answer: Option<ReloadAnswer>, outcome: &Outcome) {
    if let Some(answer) = answer {
        // The requester may have disconnected.
        let _ = answer.send(outcome.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expectation::Expectation;

    #[test]
    fn a_reload_that_panics_may_be_tried_again() {
        let mut times = 0;
        let reload: Reload = Box::new(move || {
            times += 1;
            assert!(times > 1, "on purpose");
            Ok(None)
        });
        let (_asks, asked) = tokio::sync::mpsc::channel(1);
        let mut reloader = Reloader::new(Some(reload), None, asked);
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(async {
            Expectation::of("reload-panics").assert_said(&panic_text(), &[]);
            for expected in [Err(panic_text()), Ok(())] {
                assert!(reloader.begin(None));
                let Event::Finished(outcome) = reloader.next().await else { panic!("asked") };
                assert!(!reloader.finish(&outcome));
                assert_eq!(outcome, expected);
            }
        });
    }
}
