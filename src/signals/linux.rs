//! The signals of Linux.

use core::future::pending;
use std::io;

use tokio::signal::unix::{Signal, SignalKind, signal};

/// Action for a received signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalAction {
    /// End the process, for SIGTERM or SIGINT. Also for SIGHUP if there is nothing to reload,
    /// because SIGHUP then means that a terminal was closed.
    End,
    /// Read the configuration again, for SIGHUP.
    Reload,
}

/// The signals of a process, for its runtime.
#[derive(Debug)]
pub struct Signals {
    terminate: Signal,
    interrupt: Signal,
    hangup: Option<Signal>,
    on_hangup: SignalAction,
}

impl Signals {
    /// Registers for the signals. If `reloads` is true, SIGHUP requests a reload of the
    /// configuration.
    ///
    /// # Errors
    /// Those of the system.
    pub fn register(reloads: bool) -> io::Result<Self> {
        // Under nohup(1), SIGHUP is ignored. It stays ignored unless it requests a reload.
        let listens = reloads || !hangup_is_ignored();
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
            hangup: listens.then(|| signal(SignalKind::hangup())).transpose()?,
            on_hangup: if reloads { SignalAction::Reload } else { SignalAction::End },
        })
    }

    /// Waits for a signal that ends the process.
    pub async fn end(&mut self) {
        while self.next().await != SignalAction::End {}
    }

    /// Waits for the next signal, and returns its action.
    pub async fn next(&mut self) -> SignalAction {
        let Self { terminate, interrupt, hangup, on_hangup } = self;
        let hangup = async {
            match hangup {
                Some(hangup) => hangup.recv().await,
                None => pending().await,
            }
        };
        tokio::select! {
            _ = terminate.recv() => SignalAction::End,
            _ = interrupt.recv() => SignalAction::End,
            _ = hangup => *on_hangup,
        }
    }
}

/// Returns true if the process was started with SIGHUP ignored (proc_pid_status(5), SigIgn).
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 == 1)
}
