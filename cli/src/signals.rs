//! Ending on SIGINT and SIGTERM.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Sets `stop` at the first SIGINT or SIGTERM; the second one ends the process as usual.
pub(super) fn stop_on_signal(stop: &Arc<AtomicBool>) -> std::io::Result<()> {
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_default(signal, Arc::clone(stop))?;
        signal_hook::flag::register(signal, Arc::clone(stop))?;
    }
    Ok(())
}
