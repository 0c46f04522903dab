//! The interrupt of systems without the service.

use std::io;

/// The signals of a process: its interrupt (Ctrl-C).
#[derive(Debug)]
pub struct Signals;

impl Signals {
    /// Registers for the interrupt. There is nothing to reload.
    ///
    /// # Errors
    /// None.
    pub fn register(_: bool) -> io::Result<Self> {
        Ok(Self)
    }

    /// Waits for the interrupt.
    pub async fn end(&mut self) {
        // Without a handler, the system ends the process.
        if tokio::signal::ctrl_c().await.is_err() {
            core::future::pending().await
        }
    }
}
