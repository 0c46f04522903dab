//! Settings and errors that all threads of the service share.

use std::io;

use nix::sys::signal::{SigSet, Signal};

use super::ServiceError;

/// Returns the conversion of a system error of an attempted operation.
pub(super) fn system(action: &'static str) -> impl Fn(io::Error) -> ServiceError {
    move |cause| ServiceError::System { action, cause }
}

/// Leaves the handled signals to the thread of the supervision, so that they interrupt no wait of
/// this one. If the system refuses, every wait continues after an interruption.
pub(super) fn block_signals() {
    let handled: SigSet = [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP].into_iter().collect();
    let _ = handled.thread_block();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_leaves_the_handled_signals_to_the_supervision() {
        let blocked = std::thread::spawn(|| {
            block_signals();
            SigSet::thread_get_mask().unwrap()
        });
        let blocked = blocked.join().unwrap();
        for signal in [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP] {
            assert!(blocked.contains(signal), "{signal}");
        }
        // One that nobody handles ends the process wherever it arrives.
        assert!(!blocked.contains(Signal::SIGUSR1));
    }
}
