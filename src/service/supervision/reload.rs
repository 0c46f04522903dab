//! Reading the configuration again while the service runs: on SIGHUP, or when it is asked for.

use core::future::pending;
use core::time::Duration;
use std::panic::{AssertUnwindSafe, catch_unwind};

use tokio::sync::mpsc::Receiver;
use tokio::task::JoinHandle;

use crate::live::worker::{Commands, Configuration};
use crate::service::status::ReloadAnswer;

/// How long the worker may take to accept a configuration.
const WORKER_TIMEOUT: Duration = Duration::from_secs(2);

/// Reads the configuration again, and checks that it can be taken over without a restart. Gives what
/// the worker is to use from its next window on, where there is one, or says why not.
pub type Reload = Box<dyn FnMut() -> Result<Option<Configuration>, String> + Send>;

type Outcome = Result<(), String>;

/// One reload at a time, off the thread that serves and feeds the watchdog.
pub(super) struct Reloader {
    reload: Option<Reload>,
    commands: Option<Commands>,
    asked: Receiver<ReloadAnswer>,
    running: Option<JoinHandle<(Reload, Outcome)>>,
    /// Who waits for the one that runs.
    answer: Option<ReloadAnswer>,
    /// A signal came while one ran: what it read may be older than the signal.
    again: bool,
}

/// What there is to do.
pub(super) enum Event {
    /// One begins.
    Asked(ReloadAnswer),
    /// One is over.
    Finished(Outcome),
}

impl Reloader {
    pub(super) fn new(
        reload: Option<Reload>,
        commands: Option<Commands>,
        asked: Receiver<ReloadAnswer>,
    ) -> Self {
        Self { reload, commands, asked, running: None, answer: None, again: false }
    }

    /// Waits until somebody asks, or what runs is over. Nothing is lost when it is dropped.
    pub(super) async fn next(&mut self) -> Event {
        match &mut self.running {
            Some(running) => {
                let ended = running.await;
                self.running = None;
                Event::Finished(match ended {
                    Ok((reload, outcome)) => {
                        self.reload = Some(reload);
                        outcome
                    }
                    // The runtime ends.
                    Err(_) => Err(panicked()),
                })
            }
            None => match self.asked.recv().await {
                Some(answer) => Event::Asked(answer),
                None => pending().await,
            },
        }
    }

    /// Begins; true when one has begun, false when it follows the one that runs, or cannot be done.
    pub(super) fn begin(&mut self, answer: Option<ReloadAnswer>) -> bool {
        if self.running.is_some() {
            self.again = true;
            return false;
        }
        let Some(mut reload) = self.reload.take() else {
            tell(answer, &Err("there is no file to reload".to_owned()));
            return false;
        };
        self.answer = answer;
        let commands = self.commands.clone();
        self.running = Some(tokio::task::spawn_blocking(move || {
            // One that panics is there for the next time all the same.
            let read = catch_unwind(AssertUnwindSafe(&mut reload));
            let read = read.unwrap_or_else(|_| Err(panicked()));
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

    /// Answers who asked; whether another one has to follow.
    pub(super) fn finish(&mut self, outcome: &Outcome) -> bool {
        tell(self.answer.take(), outcome);
        core::mem::take(&mut self.again)
    }
}

fn panicked() -> String {
    "reading it panicked: see the log before this".to_owned()
}

fn tell(answer: Option<ReloadAnswer>, outcome: &Outcome) {
    if let Some(answer) = answer {
        // Whoever asked may have gone.
        let _ = answer.send(outcome.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            for expected in [Err(panicked()), Ok(())] {
                assert!(reloader.begin(None));
                let Event::Finished(outcome) = reloader.next().await else { panic!("asked") };
                assert!(!reloader.finish(&outcome));
                assert_eq!(outcome, expected);
            }
        });
    }
}
