//! `didim metrics`: serves the status to Prometheus, in a separate process.

use core::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;

use super::status::WhichService;
use crate::CliError;
use didim::service::metrics::{Limits, metrics_text, serve};
use didim::service::status::fetch_snapshot;
use didim::signals::Signals;

/// Default address: this machine only.
const DEFAULT_ADDRESS: &str = "127.0.0.1:9752";

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    service: WhichService,
    /// The address to listen at; the default answers only this machine
    #[arg(long, value_name = "ADDRESS:PORT", default_value = DEFAULT_ADDRESS)]
    listen: SocketAddr,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let paths = arguments.service.paths()?;
    // True if the last request was answered. Only a change is logged, not every scrape.
    let answered = AtomicBool::new(true);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .max_blocking_threads(2)
        .build()
        .map_err(CliError::from_failure)?;
    runtime.block_on(async {
        let mut signals = Signals::register(false).map_err(CliError::from_failure)?;
        tokio::select! {
                served = serve(arguments.listen, Limits::default(), print_ready, move || {
            let snapshot = fetch_snapshot(&paths);
            match (&snapshot, answered.swap(snapshot.is_ok(), Ordering::Relaxed)) {
                (Err(why), true) => tracing::warn!("the service does not answer: {why}"),
                (Ok(_), false) => tracing::info!("the service answers again"),
                (Ok(_), true) | (Err(_), false) => {}
            }
            metrics_text(snapshot.as_ref().ok())
        }) => {
                    served.map(|never| match never {}).map_err(CliError::from_failure)
                }
                () = signals.end() => Ok(()),
            }
    })?;
    // A scrape may still wait for the service; the exit does not wait for the scrape.
    runtime.shutdown_background();
    Ok(())
}

fn print_ready(address: SocketAddr) {
    tracing::info!("metrics at http://{address}/metrics");
    if let Err(cause) = sd_notify::notify(&[sd_notify::NotifyState::Ready]) {
        tracing::warn!("cannot notify systemd: {cause}");
    }
}
