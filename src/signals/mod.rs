//! Signals to a process. All signal handlers are registered here.

#[cfg(target_os = "linux")]
mod linux;
#[cfg(not(target_os = "linux"))]
mod other;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::runtime::Builder;

#[cfg(target_os = "linux")]
pub use linux::{SignalAction, Signals};
#[cfg(not(target_os = "linux"))]
pub use other::Signals;

use crate::files::discard_unfinished;

/// Exit code of a command that a signal has ended early. It is the code that shells return for
/// SIGINT.
pub const EXIT_CODE_INTERRUPTED: u8 = 130;

/// Returns a flag that the first signal sets. The second signal ends the process immediately.
///
/// # Errors
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
/// # Errors
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
