//! The subcommands, one file each. Those that need the service stand in `service`, for Linux only.

mod advise;
mod compare;
mod completions;
mod convert;
mod convert_frames;
mod design;
mod export;
mod external_torque;
mod fleet;
mod gains;
pub(crate) mod groups;
mod history;
mod identify;
pub(crate) mod manual;
mod new;
mod payload;
mod predict;
mod robot;
#[cfg(target_os = "linux")]
mod service;
mod sim;
mod state;
mod study;

use clap::Subcommand;

use crate::CliError;

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Commands of the service, and of its results
    #[cfg(target_os = "linux")]
    #[command(flatten)]
    Service(service::Command),
    /// Put a simulated arm on a bus
    Sim(sim::Arguments),
    /// Identify offline, from a table, a candump log or an MCAP recording
    Identify(identify::Arguments),
    /// Predict the torques of a recording with a stored result, without fitting
    Predict(predict::Arguments),
    /// Estimate the torque of contacts along a recording with a stored result
    ExternalTorque(external_torque::Arguments),
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
    /// Show the results over time, compared with the baseline
    History(history::Arguments),
    /// Show which parameter of which arm differs from all other arms of its type
    Fleet(fleet::Arguments),
    /// Write the folder of results for an earlier version of didim
    State(state::Arguments),
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
        match self {
            #[cfg(target_os = "linux")]
            Self::Service(command) => command.is_daemon(),
            _ => false,
        }
    }

    /// Returns true if the command handles SIGINT and SIGTERM itself.
    pub(crate) fn handles_signals(&self) -> bool {
        match self {
            #[cfg(target_os = "linux")]
            Self::Service(command) => command.handles_signals(),
            _ => matches!(self, Self::Sim(_) | Self::Study(_)),
        }
    }

    /// Runs the command.
    pub(crate) fn execute(&self) -> Result<(), CliError> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Service(command) => command.execute(),
            Self::Sim(arguments) => sim::execute(arguments),
            Self::New(arguments) => new::execute(arguments),
            Self::Robot(arguments) => robot::execute(arguments),
            Self::Identify(arguments) => identify::execute(arguments),
            Self::Predict(arguments) => predict::execute(arguments),
            Self::ExternalTorque(arguments) => external_torque::execute(arguments),
            Self::Payload(arguments) => payload::execute(arguments),
            Self::Gains(arguments) => gains::execute(arguments),
            Self::Export(arguments) => export::execute(arguments),
            Self::Advise(arguments) => advise::execute(arguments),
            Self::Design(arguments) => design::execute(arguments),
            Self::Compare(arguments) => compare::execute(arguments),
            Self::Study(arguments) => study::execute(arguments),
            Self::Convert(arguments) => convert::execute(arguments),
            Self::History(arguments) => history::execute(arguments),
            Self::Fleet(arguments) => fleet::execute(arguments),
            Self::State(arguments) => state::execute(arguments),
            Self::Completions(arguments) => completions::execute(arguments, crate::command()),
            Self::Manual(arguments) => manual::execute(arguments, crate::command()),
        }
    }
}
