//! The subcommands, one file each.

mod advise;
mod baseline;
mod bundle;
mod capture;
mod check;
mod compare;
mod completions;
mod convert;
mod convert_frames;
mod demo;
mod design;
mod export;
mod fleet;
mod gains;
pub(crate) mod groups;
mod history;
mod identify;
pub(crate) mod manual;
mod metrics;
mod new;
mod note;
mod payload;
mod predict;
mod reload;
mod replay;
mod report;
mod robot;
mod run;
mod sim;
mod state;
mod status;
mod study;
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
    /// Put the simulated TX40 on a bus
    Sim(sim::Arguments),
    /// Send a candump log or an MCAP recording through the same pipeline as `run`
    Replay(replay::Arguments),
    /// Identify offline, from a table, a candump log or an MCAP recording
    Identify(identify::Arguments),
    /// Predict the torques of a recording with a stored result, without fitting
    Predict(predict::Arguments),
    /// Find the payload of the arm in a recording: mass, centre, inertia, each with its uncertainty
    Payload(payload::Arguments),
    /// Find the drives' torque gains, from recordings without and with a payload of known mass and
    /// centre
    Gains(gains::Arguments),
    /// Write a stored result as a physically consistent model: URDF, MJCF, robot file, JSON,
    /// MATLAB, C or Rust
    Export(export::Arguments),
    /// Show what a result is missing, and which motions of one or two joints would identify it
    Advise(advise::Arguments),
    /// Design the next motion: within the arm's limits, and to identify what a result is missing
    Design(design::Arguments),
    /// Identify with every method and compare them
    Compare(compare::Arguments),
    /// Run a plan of simulated experiments: noise, model errors, methods, seeds
    Study(study::Arguments),
    /// Write a cell file from a URDF and a table, a bag, a DBC file or device files; show what is
    /// found, assumed and missing
    New(new::Arguments),
    /// Show the arm that a robot file or a URDF describes: axes, reach, base parameters, a picture
    Robot(robot::Arguments),
    /// Convert between a table, a candump log and an MCAP recording
    Convert(convert::Arguments),
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
    /// Show the results over time, compared with the baseline
    History(history::Arguments),
    /// Write the report of a stored result (one HTML file)
    Report(report::Arguments),
    /// Show which parameter of which arm differs from all other arms of its type
    Fleet(fleet::Arguments),
    /// Set, clear or show the baseline for comparison with later results
    Baseline(baseline::Arguments),
    /// Write the folder of results for an earlier version of didim
    State(state::Arguments),
    /// Pack what a service saw into one file, for somebody who cannot see the machine
    Bundle(bundle::Arguments),
    /// Check a cell file and this machine before the service is started
    Check(check::Arguments),
    /// Print the completions of a shell, for it to read at its start
    Completions(completions::Arguments),
    /// Write man pages and completions into a folder
    #[command(hide = true)]
    Manual(manual::Arguments),
}

impl Command {
    /// Returns true if the command is a daemon. A daemon logs its actions; other commands log only
    /// problems.
    pub(crate) fn is_daemon(&self) -> bool {
        matches!(self, Self::Run(_) | Self::Metrics(_))
    }

    /// Returns true if the command handles SIGINT and SIGTERM itself.
    pub(crate) fn handles_signals(&self) -> bool {
        matches!(
            self,
            Self::Run(_)
                | Self::Metrics(_)
                | Self::Top(_)
                | Self::Sim(_)
                | Self::Study(_)
                | Self::Demo(_)
                | Self::Replay(_)
        )
    }

    /// Runs the command.
    pub(crate) fn execute(&self) -> Result<(), CliError> {
        match self {
            Self::Demo(arguments) => demo::execute(arguments),
            Self::Run(arguments) => run::execute(arguments),
            Self::Sim(arguments) => sim::execute(arguments),
            Self::Replay(arguments) => replay::execute(arguments),
            Self::New(arguments) => new::execute(arguments),
            Self::Robot(arguments) => robot::execute(arguments),
            Self::Identify(arguments) => identify::execute(arguments),
            Self::Predict(arguments) => predict::execute(arguments),
            Self::Payload(arguments) => payload::execute(arguments),
            Self::Gains(arguments) => gains::execute(arguments),
            Self::Export(arguments) => export::execute(arguments),
            Self::Advise(arguments) => advise::execute(arguments),
            Self::Design(arguments) => design::execute(arguments),
            Self::Compare(arguments) => compare::execute(arguments),
            Self::Study(arguments) => study::execute(arguments),
            Self::Convert(arguments) => convert::execute(arguments),
            Self::Status(arguments) => status::execute(arguments),
            Self::Metrics(arguments) => metrics::execute(arguments),
            Self::Capture(arguments) => capture::execute(arguments),
            Self::Top(arguments) => top::execute(arguments),
            Self::Window(arguments) => window::execute(arguments),
            Self::Reload(arguments) => reload::execute(arguments),
            Self::Note(arguments) => note::execute(arguments),
            Self::History(arguments) => history::execute(arguments),
            Self::Report(arguments) => report::execute(arguments),
            Self::Fleet(arguments) => fleet::execute(arguments),
            Self::Baseline(arguments) => baseline::execute(arguments),
            Self::State(arguments) => state::execute(arguments),
            Self::Bundle(arguments) => bundle::execute(arguments),
            Self::Check(arguments) => check::execute(arguments),
            Self::Completions(arguments) => completions::execute(arguments, crate::command()),
            Self::Manual(arguments) => manual::execute(arguments, crate::command()),
        }
    }
}
