//! Signals to a process: the one place where they are registered.

use core::future::pending;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::runtime::Builder;
use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::files::discard_unfinished;

/// Exit code of a command that was told to end before it was done: what shells give for SIGINT.
pub const INTERRUPTED: u8 = 130;

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// SIGTERM or SIGINT; SIGHUP where there is nothing to read again: a terminal was closed.
    End,
    /// SIGHUP.
    Reload,
}

/// The signals of a process, for its runtime.
#[derive(Debug)]
pub struct Signals {
    terminate: Signal,
    interrupt: Signal,
    hangup: Option<Signal>,
    on_hangup: Told,
}

impl Signals {
    /// Registers for them; `reloads` says whether SIGHUP means to read the configuration again.
    ///
    /// # Errors
    /// The system's.
    pub fn register(reloads: bool) -> io::Result<Self> {
        // Under nohup(1) it is ignored, and stays so unless it has another meaning.
        let listens = reloads || !hangup_is_ignored();
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
            hangup: listens.then(|| signal(SignalKind::hangup())).transpose()?,
            on_hangup: if reloads { Told::Reload } else { Told::End },
        })
    }

    /// Waits for a signal that ends the process.
    pub async fn end(&mut self) {
        while self.next().await != Told::End {}
    }

    /// The next signal.
    pub async fn next(&mut self) -> Told {
        let Self { terminate, interrupt, hangup, on_hangup } = self;
        let hangup = async {
            match hangup {
                Some(hangup) => hangup.recv().await,
                None => pending().await,
            }
        };
        tokio::select! {
            _ = terminate.recv() => Told::End,
            _ = interrupt.recv() => Told::End,
            _ = hangup => *on_hangup,
        }
    }
}

/// A flag that the first signal sets; the second ends the process at once.
///
/// # Errors
/// The system gives no handler or thread.
pub fn stop_flag() -> io::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&stop);
    at_each(move || {
        if told.swap(true, Ordering::Relaxed) {
            end_now();
        }
    })?;
    Ok(stop)
}

/// Lets the first signal end the process, with [`INTERRUPTED`] and without files that are half
/// written.
///
/// # Errors
/// The system gives no handler or thread.
pub fn end_on_signal() -> io::Result<()> {
    at_each(end_now)
}

fn end_now() {
    discard_unfinished();
    std::process::exit(i32::from(INTERRUPTED));
}

/// Does something at each signal that ends a process, on a thread of its own.
fn at_each(mut act: impl FnMut() + Send + 'static) -> io::Result<()> {
    let runtime = Builder::new_current_thread().enable_io().build()?;
    // Before this returns, not when the thread gets to run.
    let mut signals = runtime.block_on(async { Signals::register(false) })?;
    let wait = move || {
        runtime.block_on(async {
            loop {
                signals.end().await;
                act();
            }
        });
    };
    std::thread::Builder::new().name("signals".into()).spawn(wait).map(drop)
}

/// Whether the process was started with SIGHUP ignored (proc_pid_status(5), SigIgn).
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 == 1)
}
