//! Notifications to the service manager (sd_notify(3)). Without a manager, none are sent.

use core::time::Duration;

use sd_notify::NotifyState;

use crate::service::status::one_line;

/// Maximum length of a status line \[characters\].
const MAX_LINE: usize = 1000;
/// Time by which one request extends the start timeout \[µs\].
const EXTENSION_USEC: u32 = 10_000_000;

/// Interface to the service manager.
#[derive(Debug)]
pub(super) struct Manager {
    is_ready: bool,
    watchdog: Option<Duration>,
}

impl Manager {
    pub(super) fn from_environment() -> Self {
        Self { is_ready: false, watchdog: sd_notify::watchdog_enabled() }
    }

    /// Returns the interval at which the watchdog is notified. It is half of the watchdog time, as
    /// sd_watchdog_enabled(3) recommends.
    pub(super) fn watchdog_period(&self) -> Option<Duration> {
        self.watchdog.map(|every| (every / 2).max(Duration::from_millis(1)))
    }

    /// Returns true if READY=1 was sent.
    pub(super) fn is_ready(&self) -> bool {
        self.is_ready
    }

    /// Reports that the start is complete.
    pub(super) fn notify_ready(&mut self, line: &str) {
        self.is_ready = true;
        notify(&[NotifyState::Status(&bounded_line(line)), NotifyState::Ready]);
    }

    /// Requests more time for the start.
    pub(super) fn extend_start(&self) {
        if !self.is_ready {
            notify(&[NotifyState::ExtendTimeoutUsec(EXTENSION_USEC)]);
        }
    }

    /// Sends a status line for people.
    pub(super) fn notify_status(&self, line: &str) {
        notify(&[NotifyState::Status(&bounded_line(line))]);
    }

    /// Notifies the watchdog that all threads are healthy.
    pub(super) fn feed_watchdog(&self) {
        notify(&[NotifyState::Watchdog]);
    }

    /// Reports the start of a reload. The message has to contain the time as well
    /// (systemd.service(5), notify-reload).
    pub(super) fn notify_reloading(&self) {
        if !self.is_ready {
            return;
        }
        match NotifyState::monotonic_usec_now() {
            Ok(now) => notify(&[NotifyState::Reloading, now]),
            Err(cause) => tracing::debug!("the clock cannot be read: {cause}"),
        }
    }

    /// Reports the end of a reload. It is sent for every outcome, because the service is as ready
    /// as before.
    pub(super) fn notify_reloaded(&self, line: &str) {
        // READY=1 must not be sent before the start is complete.
        if self.is_ready {
            notify(&[NotifyState::Status(&bounded_line(line)), NotifyState::Ready]);
        }
    }

    /// Reports the beginning of the stop. If the start is not complete, reports its completion
    /// first, because a log may be shorter than a start.
    pub(super) fn notify_stopping(&mut self) {
        if !self.is_ready {
            self.notify_ready("stopping");
        }
        notify(&[NotifyState::Stopping]);
    }
}

/// Limits the length and removes line breaks, because text after a line break would be another
/// assignment of the protocol.
fn bounded_line(line: &str) -> String {
    one_line(line, MAX_LINE)
}

fn notify(states: &[NotifyState<'_>]) {
    if let Err(cause) = sd_notify::notify(states) {
        tracing::debug!("cannot notify the service manager: {cause}");
    }
}
