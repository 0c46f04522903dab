//! Long work without the interpreter's lock.

use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Interval at which a wait looks for an interrupt.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Runs work on its own thread and waits for it. Other Python threads go on. An interrupt (Ctrl-C)
/// ends the wait with its exception; the work then ends by itself, and its outcome is dropped.
pub(crate) fn run<T: Send + 'static>(
    python: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (done, outcome) = sync_channel(1);
    std::thread::Builder::new().name("didim".into()).spawn(move || {
        // Nobody receives the outcome after an interrupt.
        let _ = done.send(work());
    })?;
    // The wait without the lock may only borrow what threads may share.
    let outcome = Mutex::new(outcome);
    loop {
        let received = python.detach(|| {
            let outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner);
            outcome.recv_timeout(SIGNAL_INTERVAL)
        });
        match received {
            Ok(outcome) => return Ok(outcome),
            Err(RecvTimeoutError::Timeout) => python.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                let problem = "the computation ended by itself: please report this";
                return Err(PyRuntimeError::new_err(problem));
            }
        }
    }
}
