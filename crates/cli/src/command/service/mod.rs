//! The commands of the service, of its bus and of its results.

mod baseline;
mod bundle;
mod capture;
mod check;
mod demo;
mod metrics;
mod note;
mod reload;
mod replay;
mod report;
mod run;
mod status;
mod top;
mod window;

use clap::Subcommand;

use crate::CliError;

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Identify a simulated TX40: virtual drives, in-process bus, buffer, worker, table and figure
    Demo(demo::Arguments),
    /// Listen to a cell's bus and identify, until stopped
    Run(run::Arguments),
    /// Send a candump log or an MCAP recording through the same pipeline as `run`
    Replay(replay::Arguments),
    /// Show the status of a running service
    Status(status::Arguments),
    /// Serve the status of a running service to Prometheus
    Metrics(metrics::Arguments),
    /// Watch the status of a running service
    Top(top::Arguments),
    /// Open, close or identify the running service's window by hand
    Window(window::Arguments),
    /// Make the running service reload its cell file
    Reload(reload::Arguments),
    /// Record the bus from now on, until stopped
    Capture(capture::Arguments),
    /// Attach payload, temperature or a text to the open window or the next one
    Note(note::Arguments),
    /// Write the report of a stored result (one HTML file)
    Report(report::Arguments),
    /// Set, clear or show the baseline for comparison with later results
    Baseline(baseline::Arguments),
    /// Pack what a service saw into one file, for somebody who cannot see the machine
    Bundle(bundle::Arguments),
    /// Check a cell file and this machine before the service is started
    Check(check::Arguments),
}

impl Command {
    /// Returns true if the command is a daemon.
    pub(super) fn is_daemon(&self) -> bool {
        matches!(self, Self::Run(_) | Self::Metrics(_))
    }

    /// Returns true if the command handles SIGINT and SIGTERM itself.
    pub(super) fn handles_signals(&self) -> bool {
        self.is_daemon() || matches!(self, Self::Top(_) | Self::Demo(_) | Self::Replay(_))
    }

    /// Runs the command.
    pub(super) fn execute(&self) -> Result<(), CliError> {
        match self {
            Self::Demo(arguments) => demo::execute(arguments),
            Self::Run(arguments) => run::execute(arguments),
            Self::Replay(arguments) => replay::execute(arguments),
            Self::Status(arguments) => status::execute(arguments),
            Self::Metrics(arguments) => metrics::execute(arguments),
            Self::Top(arguments) => top::execute(arguments),
            Self::Window(arguments) => window::execute(arguments),
            Self::Reload(arguments) => reload::execute(arguments),
            Self::Capture(arguments) => capture::execute(arguments),
            Self::Note(arguments) => note::execute(arguments),
            Self::Report(arguments) => report::execute(arguments),
            Self::Baseline(arguments) => baseline::execute(arguments),
            Self::Bundle(arguments) => bundle::execute(arguments),
            Self::Check(arguments) => check::execute(arguments),
        }
    }
}
