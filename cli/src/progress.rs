//! How far long work is, on the terminal of standard error, and what else is written there.

use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// The bar that is on the terminal now: whoever else writes there has it out of the way meanwhile.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

fn shown() -> MutexGuard<'static, Option<ProgressBar>> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A bar, drawn by a template; hidden where stderr is no terminal.
pub(super) fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    // A template that does not parse would be a mistake of ours; the default does as well.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// Standard error, with what shows how far work is out of the way meanwhile.
pub(super) struct Beside;

impl Write for Beside {
    fn write(&mut self, text: &[u8]) -> std::io::Result<usize> {
        let write = || std::io::stderr().write_all(text).map(|()| text.len());
        match &*shown() {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Long work, which shows on the terminal of standard error that it goes on, and for how long; nowhere else. Work of a
/// moment shows nothing.
pub(super) struct Working(ProgressBar);

/// How often it moves.
const TICK: Duration = Duration::from_millis(200);

impl Working {
    /// Of what is done: `reading drive.log`.
    pub(super) fn on(what: &str) -> Self {
        let bar = styled(ProgressBar::new_spinner(), "{spinner} {wide_msg} {elapsed}");
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(TICK);
        *shown() = Some(bar.clone());
        Self(bar)
    }

    /// While that is done.
    pub(super) fn during<T>(self, work: impl FnOnce() -> T) -> T {
        work()
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        *shown() = None;
        self.0.finish_and_clear();
    }
}
