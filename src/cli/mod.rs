//! The command line: one file per subcommand, each thin.
//!
//! Exit codes: 0 done; 1 the identification was refused or failed (the reason on stderr); 2 usage;
//! 78 configuration.

mod check;
mod error;
mod identify;
mod output;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use error::CliError;

/// Identifies a robot's dynamic parameters, with their uncertainty, from the frames on its drive
/// bus.
#[derive(Debug, Parser)]
#[command(name = "didim", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Identify offline, from a CSV experiment or a candump log
    Identify(identify::Arguments),
    /// Say what would not work, before the service is started
    Check(check::Arguments),
}

/// Reads the arguments of the process, runs the command and says how it ended.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version go to stdout with code 0, mistakes to stderr with code 2.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    log_to_stderr();
    let outcome = match arguments.command {
        Command::Identify(arguments) => identify::execute(&arguments),
        Command::Check(arguments) => check::execute(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

/// Logs go to stderr, so that stdout carries results only. `RUST_LOG` chooses what is logged.
fn log_to_stderr() {
    use std::io::IsTerminal as _;

    use tracing_subscriber::EnvFilter;

    let filter =
        EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,didim=info"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .init();
}
