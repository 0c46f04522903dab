//! The program `didim`: its arguments, its log and its exit code. [`command`] has one file per
//! subcommand.
//!
//! Exit codes: 0 done; 1 the identification was refused or failed (the reason on stderr); 2 usage;
//! 3 the work was done, but its result does not meet a requirement (`--require`, `--limits`); 78
//! configuration; 130 stopped before it was done (SIGINT, SIGTERM, SIGHUP).

#![cfg_attr(
    not(target_os = "linux"),
    allow(dead_code, unused_imports, reason = "the service alone uses it")
)]

mod bundle;
mod choices;
mod command;
mod error;
mod first_posture;
mod frame;
mod input;
mod long_numbers;
mod names;
mod next;
mod notes;
#[cfg(target_os = "linux")]
mod outcome;
mod output;
mod progress;
mod required_uses;
mod state;
mod stored_result;
mod stream;
mod terminal;
mod torque_joints;

use std::process::ExitCode;

use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser};
use tracing::level_filters::LevelFilter;

pub use command::manual::{Generated, completions, documents, man_pages, schemas};
pub use error::CliError;

/// Version, commit and features, one a line. build.rs finds the last two.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit: ",
    env!("DIDIM_BUILT_COMMIT"),
    "\nfeatures: ",
    env!("DIDIM_BUILT_FEATURES")
);

/// Identifies a robot's dynamic parameters, with their uncertainty, from the frames on its drive
/// bus.
#[derive(Debug, Parser)]
#[command(name = "didim", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: command::Command,
}

/// Returns the definition of the command line.
pub fn command() -> clap::Command {
    let command = Arguments::command();
    let help = command::groups::grouped_help(&command);
    command.help_template(help)
}

/// Reads the arguments of the process, runs the command and returns its exit code.
pub fn main() -> ExitCode {
    let matches = command().long_version(LONG_VERSION).try_get_matches();
    let read = matches.and_then(|of| Ok((Arguments::from_arg_matches(&of)?, takes_default(&of))));
    let (arguments, takes_default) = match read {
        Ok(read) => read,
        Err(error) => {
            // Help and version go to stdout with code 0, usage errors to stderr with code 2.
            if error.use_stderr() {
                let _ = error.print();
                return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
            }
            let text = error.render();
            let coloured = terminal::has_colours(&std::io::stdout());
            let text = if coloured { text.ansi().to_string() } else { text.to_string() };
            return match output::print(&text) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => error.report(),
            };
        }
    };
    // A daemon logs its actions; a command that a person waits for logs only problems.
    log_to_stderr(if arguments.command.is_daemon() {
        LevelFilter::INFO
    } else {
        LevelFilter::WARN
    });
    if takes_default {
        notes::print_note(&format!(
            "didim: the cell is {}, as --cell names none\n",
            names::DEFAULT_CELL
        ));
    }
    if !arguments.command.handles_signals()
        && let Err(error) = didim::signals::end_on_signal()
    {
        return CliError::from_failure(error).report();
    }
    match arguments.command.execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

/// Returns true if `--cell` is missing and the default cell is used.
fn takes_default(matches: &ArgMatches) -> bool {
    let of_command = matches.subcommand().map(|(_, of)| of);
    let named = of_command.filter(|of| of.try_contains_id("cell").is_ok());
    named.is_some_and(|of| of.value_source("cell") == Some(ValueSource::DefaultValue))
}

/// Logs to stderr, so that stdout has results only. `RUST_LOG` selects the levels by module, as
/// `warn,didim=debug`.
fn log_to_stderr(usual: LevelFilter) {
    use tracing_subscriber::filter::Targets;
    use tracing_subscriber::prelude::*;

    let chosen = std::env::var("RUST_LOG").ok().filter(|filter| !filter.is_empty());
    let chosen = chosen.and_then(|filter| filter.parse().ok());
    let filter: Targets = chosen.unwrap_or_else(|| {
        Targets::new()
            .with_default(LevelFilter::WARN)
            // The library of the shared-memory stream logs a warning with a full memory dump if one
            // end disconnects while another one connects.
            .with_target("iceoryx2_bb_loggers", LevelFilter::ERROR)
            .with_target("didim", usual)
    });
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(|| progress::ProgressWriter)
        // If stderr is closed or full, the error cannot be reported.
        .log_internal_errors(false)
        .with_ansi(terminal::has_colours(&std::io::stderr()))
        .with_target(false);
    tracing_subscriber::registry().with(lines).with(filter).init();
}
