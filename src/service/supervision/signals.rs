//! What the system tells the service to do.

use core::future::pending;

use tokio::signal::unix::{Signal, SignalKind, signal};

use super::ServiceError;

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Told {
    /// SIGTERM or SIGINT.
    End,
    /// SIGHUP.
    Reload,
}

pub(super) struct Signals {
    terminate: Signal,
    interrupt: Signal,
    /// Only where there is something to read again: elsewhere it ends the process, as a terminal
    /// that is closed should.
    hangup: Option<Signal>,
}

impl Signals {
    pub(super) fn register(reloads: bool) -> Result<Self, ServiceError> {
        let register = |kind| {
            signal(kind)
                .map_err(|cause| ServiceError::System { action: "register for signals", cause })
        };
        Ok(Self {
            terminate: register(SignalKind::terminate())?,
            interrupt: register(SignalKind::interrupt())?,
            hangup: reloads.then(|| register(SignalKind::hangup())).transpose()?,
        })
    }

    /// SIGTERM or SIGINT.
    pub(super) async fn end(&mut self) {
        while self.next().await != Told::End {}
    }

    /// The next signal.
    pub(super) async fn next(&mut self) -> Told {
        let Self { terminate, interrupt, hangup } = self;
        let hangup = async {
            match hangup {
                Some(hangup) => hangup.recv().await,
                None => pending().await,
            }
        };
        tokio::select! {
            _ = terminate.recv() => Told::End,
            _ = interrupt.recv() => Told::End,
            _ = hangup => Told::Reload,
        }
    }
}
