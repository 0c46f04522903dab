//! `didim-publish`: sends the states and results of the cabinet services on this machine to an MQTT
//! broker.
//!
//! The program reads status sockets and histories, and writes to none of them. Each cabinet has its
//! own thread and its own connection. So each cabinet has a last will, and none waits for another.

mod cabinet;
mod configuration;
mod ledger;
mod link;
mod message;
mod send;

use std::error::Error;
use std::fs::File;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use didim::files::{discard_unfinished, own_folder, remove_leftovers};
use didim::signals::Signals;
use rustix::fs::{FlockOperation, flock};
use tokio::runtime::Builder;

use cabinet::Cabinet;
use configuration::Configuration;
use send::send;

/// Exit code for a wrong configuration: `EX_CONFIG` of sysexits.h.
const EXIT_CODE_CONFIGURATION: u8 = 78;

/// Sends states, results, drift and alarms of the cabinets on this machine to an MQTT broker.
#[derive(Debug, Parser)]
#[command(name = "didim-publish", version, max_term_width = 100)]
struct Arguments {
    /// Broker and cabinets
    #[arg(long, value_name = "FILE", default_value = "/etc/didim/publish.toml")]
    config: PathBuf,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    log_to_stderr();
    let configuration = match Configuration::read(&arguments.config) {
        Ok(configuration) => configuration,
        Err(error) => return report(&error, EXIT_CODE_CONFIGURATION),
    };
    let ran = run(&configuration);
    discard_unfinished();
    match ran {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => report(&*error, 1),
    }
}

fn report(error: &dyn Error, code: u8) -> ExitCode {
    tracing::error!("{error}");
    ExitCode::from(code)
}

/// Sends messages until a signal ends the process. The threads end with the process, and the broker
/// then publishes the last wills of the cabinets.
fn run(configuration: &Configuration) -> Result<(), Box<dyn Error>> {
    let folder = &configuration.state_directory;
    own_folder(folder)?;
    let _locked = lock(folder)?;
    remove_leftovers(folder, |name| name.ends_with(".json"))?;
    let open_cabinet = |section| Cabinet::open(section, folder);
    let cabinets =
        configuration.cabinets.iter().map(open_cabinet).collect::<Result<Vec<_>, _>>()?;
    let runtime = Builder::new_current_thread().enable_io().build()?;
    let mut signals = runtime.block_on(async { Signals::register(false) })?;
    for cabinet in cabinets {
        let (broker, prefix) = (configuration.broker.clone(), configuration.prefix.clone());
        let cabinet_runtime = Builder::new_current_thread().enable_all().build()?;
        std::thread::Builder::new().name(cabinet.name().to_owned()).spawn(move || {
            let _whole = ProcessGuard;
            cabinet_runtime.block_on(send(cabinet, &broker, &prefix))
        })?;
    }
    if let Err(cause) = sd_notify::notify(&[sd_notify::NotifyState::Ready]) {
        tracing::warn!("cannot notify systemd: {cause}");
    }
    runtime.block_on(signals.end());
    Ok(())
}

/// Guard that ends the process if a thread ends. A thread ends only by a panic. Without this guard
/// the other cabinets would continue, and nobody would notice the missing one.
struct ProcessGuard;

impl Drop for ProcessGuard {
    fn drop(&mut self) {
        std::process::exit(1);
    }
}

/// Locks the folder of the ledgers against a second process. Two processes with the same cabinets
/// would end each other's connections at the broker.
fn lock(folder: &Path) -> Result<File, Box<dyn Error>> {
    let file = File::open(folder)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|cause| {
        format!(
            "{}: {cause}; another didim-publish uses it: stop that, or name another \
            state_directory",
            folder.display()
        )
    })?;
    Ok(file)
}

/// Sets up logging to stderr. `RUST_LOG` selects the levels by module, such as
/// `warn,didim_publish=debug`.
fn log_to_stderr() {
    use tracing_subscriber::filter::{LevelFilter, Targets};
    use tracing_subscriber::prelude::*;

    let chosen = std::env::var("RUST_LOG").ok().and_then(|filter| filter.parse().ok());
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        // If stderr is closed or full, the error cannot be reported.
        .log_internal_errors(false)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false);
    let filter: Targets = chosen.unwrap_or_else(|| {
        let ours = Targets::new().with_default(LevelFilter::WARN);
        ours.with_target("didim_publish", LevelFilter::INFO)
    });
    tracing_subscriber::registry().with(lines).with(filter).init();
}
