//! Progress display of long tasks on standard error, and the other output to standard error.

use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::long_numbers::shorten_numbers;

/// Progress bar that is visible on the terminal. It is hidden while other output is written.
static VISIBLE_BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

fn visible_bar() -> MutexGuard<'static, Option<ProgressBar>> {
    VISIBLE_BAR.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Styles a bar with a template; the bar is hidden if stderr is no terminal.
pub(super) fn style_bar(bar: ProgressBar, template: &str) -> ProgressBar {
    // A template that does not parse would be a mistake in this program; the default style is good
    // enough.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// Writer to standard error. The progress bar is hidden during each write, and long numbers are
/// shortened.
pub(super) struct ProgressWriter;

impl Write for ProgressWriter {
    fn write(&mut self, text: &[u8]) -> std::io::Result<usize> {
        let shown = str::from_utf8(text).map(shorten_numbers);
        let shown = shown.as_ref().map_or(text, |shown| shown.as_bytes());
        let write = || std::io::stderr().write_all(shown).map(|()| text.len());
        match &*visible_bar() {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Display of a long task and its duration, visible only if standard error is a terminal. A very
/// short task is not displayed.
pub(super) struct WorkIndicator(ProgressBar);

/// Interval of the spinner.
const SPINNER_INTERVAL: Duration = Duration::from_millis(200);

impl WorkIndicator {
    /// Starts the display for a task, which `what` describes: `reading drive.log`.
    pub(super) fn start(what: &str) -> Self {
        let bar = style_bar(ProgressBar::new_spinner(), "{spinner} {wide_msg} {elapsed}");
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(SPINNER_INTERVAL);
        *visible_bar() = Some(bar.clone());
        Self(bar)
    }

    /// Does the work, and shows the display until the work ends.
    pub(super) fn show_during<T>(self, work: impl FnOnce() -> T) -> T {
        work()
    }
}

impl Drop for WorkIndicator {
    fn drop(&mut self) {
        *visible_bar() = None;
        self.0.finish_and_clear();
    }
}
