//! Signals to a process. All signal handlers are registered here.

use core::future::pending;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::runtime::Builder;
use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::files::discard_unfinished;

/// Exit code of a command that a signal has ended early. It is the code that shells return for
/// SIGINT.
pub const EXIT_CODE_INTERRUPTED: u8 = 130;

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
    /// Errors of the system.
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

/// Returns a flag that the first signal sets. The second signal ends the process immediately.
///
/// The system cannot provide a handler or a thread.
/// The system gives no handler or thread.
pub fn stop_flag() -> io::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    at_each(move || {
        if flag.swap(true, Ordering::Relaxed) {
            end_now();
        }
    })?;
    Ok(stop)
}

/// Makes the first signal end the process with [`EXIT_CODE_INTERRUPTED`], without leaving
/// unfinished files.
///
/// The system cannot provide a handler or a thread.
/// The system gives no handler or thread.
pub fn end_on_signal() -> io::Result<()> {
    at_each(end_now)
}

fn end_now() {
    discard_unfinished();
    std::process::exit(i32::from(EXIT_CODE_INTERRUPTED));
}

/// Calls `act` at each signal that ends a process, on a separate thread.
fn at_each(mut act: impl FnMut() + Send + 'static) -> io::Result<()> {
    let runtime = Builder::new_current_thread().enable_io().build()?;
    // The handler is registered before this function returns, and not when the thread first runs.
    let mut signals = runtime.block_on(async { Signals::register(false) })?;
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || {
            runtime.block_on(async {
                loop {
                    signals.end().await;
                    act();
                }
            });
        })
        .map(drop)
}

/// Returns true if the process was started with SIGHUP ignored (proc_pid_status(5), SigIgn).
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 == 1)
}
