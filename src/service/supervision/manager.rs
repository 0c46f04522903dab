//! Notifications of the service manager (sd_notify(3)); none are sent without one.

use core::time::Duration;

use sd_notify::NotifyState;

use crate::service::status::one_line;

/// The longest status line \[characters\].
const MAX_LINE: usize = 1000;
/// How much longer a start may take, each time that it is asked for.
const EXTENSION_USEC: u32 = 10_000_000;

/// The service manager's side of the protocol.
#[derive(Debug)]
pub(super) struct Manager {
    is_ready: bool,
    watchdog: Option<Duration>,
}

impl Manager {
    pub(super) fn from_environment() -> Self {
        Self { is_ready: false, watchdog: sd_notify::watchdog_enabled() }
    }

    /// How often the watchdog is fed: at half of its time, as sd_watchdog_enabled(3) recommends.
    pub(super) fn feeding_period(&self) -> Option<Duration> {
        self.watchdog.map(|every| (every / 2).max(Duration::from_millis(1)))
    }

    /// Whether READY=1 was said.
    pub(super) fn is_ready(&self) -> bool {
        self.is_ready
    }

    /// The start is over.
    pub(super) fn ready(&mut self, line: &str) {
        self.is_ready = true;
        tell(&[NotifyState::Status(&bounded(line)), NotifyState::Ready]);
    }

    /// The start takes its time.
    pub(super) fn extend_start(&self) {
        if !self.is_ready {
            tell(&[NotifyState::ExtendTimeoutUsec(EXTENSION_USEC)]);
        }
    }

    /// For people.
    pub(super) fn status(&self, line: &str) {
        tell(&[NotifyState::Status(&bounded(line))]);
    }

    /// All is well with the threads.
    pub(super) fn feed(&self) {
        tell(&[NotifyState::Watchdog]);
    }

    /// A reload begins. The time has to be in the same message (systemd.service(5), notify-reload).
    pub(super) fn reloading(&self) {
        if !self.is_ready {
            return;
        }
        match NotifyState::monotonic_usec_now() {
            Ok(now) => tell(&[NotifyState::Reloading, now]),
            Err(cause) => tracing::debug!("the clock cannot be read: {cause}"),
        }
    }

    /// A reload is over, whatever came of it: the service is as ready as before.
    pub(super) fn reloaded(&self, line: &str) {
        // Before the start is over, READY=1 would be early.
        if self.is_ready {
            tell(&[NotifyState::Status(&bounded(line)), NotifyState::Ready]);
        }
    }

    /// The end begins. A start that was never over is over now: a log may be shorter than a start.
    pub(super) fn stopping(&mut self) {
        if !self.is_ready {
            self.ready("stopping");
        }
        tell(&[NotifyState::Stopping]);
    }
}

/// A line break would begin another word of the protocol.
fn bounded(line: &str) -> String {
    one_line(line, MAX_LINE)
}

fn tell(states: &[NotifyState<'_>]) {
    if let Err(cause) = sd_notify::notify(states) {
        tracing::debug!("cannot notify the service manager: {cause}");
    }
}
