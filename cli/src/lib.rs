//! The command line: one file per subcommand, each thin.
//!
//! Exit codes: 0 done; 1 the identification was refused or failed (the reason on stderr); 2 usage;
//! 78 configuration; 130 told to end before it was done (SIGINT, SIGTERM, SIGHUP).

mod advise;
mod baseline;
mod capture;
mod check;
mod choices;
mod compare;
mod convert;
mod convert_frames;
mod demo;
mod design;
mod error;
mod export;
mod fleet;
mod gains;
mod history;
mod identify;
mod input;
mod manual;
mod metrics;
mod names;
mod new;
mod note;
mod outcome;
mod output;
mod payload;
mod predict;
mod progress;
mod reload;
mod replay;
mod robot;
mod run;
mod sim;
mod state;
mod status;
mod stream;
mod study;
mod tell;
mod terminal;
mod top;
mod window;

use std::process::ExitCode;

use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use tracing::level_filters::LevelFilter;

pub use error::CliError;
pub use manual::{Generated, completions, documents, man_pages};

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
    /// Identify a simulated TX40: virtual drives, in-process bus, buffer, worker, table and figure
    Demo(demo::Arguments),
    /// Listen to a cell's bus and identify, until told to stop
    Run(run::Arguments),
    /// Put the simulated TX40 on a bus
    Sim(sim::Arguments),
    /// Send a candump log or an MCAP recording through the same pipeline as `run`
    Replay(replay::Arguments),
    /// Identify offline, from a table, a candump log or an MCAP recording
    Identify(identify::Arguments),
    /// Predict the torques of a recording with a stored result, nothing fitted
    Predict(predict::Arguments),
    /// Find the load that the arm carries in a recording: mass, centre, inertia, each with its uncertainty
    Payload(payload::Arguments),
    /// Find the drives' torque gains, from recordings without and with a load of known mass and centre
    Gains(gains::Arguments),
    /// Write a stored result as a model with possible bodies: URDF, MJCF, robot file, JSON, MATLAB, C or Rust
    Export(export::Arguments),
    /// Say what a result lacks, and which motions of one joint or two would bring it
    Advise(advise::Arguments),
    /// Design the next motion: within the arm's limits, and such that it tells what an identification lacks
    Design(design::Arguments),
    /// Identify with every method and compare them
    Compare(compare::Arguments),
    /// Run a plan of simulated experiments: noise, errors of the model, methods, seeds
    Study(study::Arguments),
    /// Write a cell file from a URDF and a table, a bag, a DBC file or device files: what is found, assumed and missing
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
    /// Note payload, temperature or a text with the open window or the next one
    Note(note::Arguments),
    /// Show the results over time, compared with the baseline
    History(history::Arguments),
    /// Show which parameter of which arm differs from all other arms of its type
    Fleet(fleet::Arguments),
    /// Set, clear or show the baseline, with which later results are compared
    Baseline(baseline::Arguments),
    /// Check a cell file and this machine before the service is started
    Check(check::Arguments),
    /// Write man pages and completions into a folder
    #[command(hide = true)]
    Manual(manual::Arguments),
}

/// The command line, as it describes itself.
pub fn command() -> clap::Command {
    Arguments::command()
}

/// Reads the arguments of the process, runs the command and says how it ended.
pub fn main() -> ExitCode {
    let matches = command().try_get_matches();
    let read = matches.and_then(|of| Ok((Arguments::from_arg_matches(&of)?, takes_default(&of))));
    let (arguments, takes_default) = match read {
        Ok(read) => read,
        Err(error) => {
            // Help and version go to stdout with code 0, mistakes to stderr with code 2.
            if error.use_stderr() {
                let _ = error.print();
                return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
            }
            let text = error.render();
            let coloured = terminal::coloured(&std::io::stdout());
            let text = if coloured { text.ansi().to_string() } else { text.to_string() };
            return match output::print(&text) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => error.report(),
            };
        }
    };
    // A daemon logs what it does; a command that a person waits for logs what is wrong.
    log_to_stderr(if matches!(arguments.command, Command::Run(_) | Command::Metrics(_)) {
        LevelFilter::INFO
    } else {
        LevelFilter::WARN
    });
    if takes_default {
        tell::tell(&format!("didim: the cell is {}, as --cell names none\n", names::DEFAULT_CELL));
    }
    let sees_to_signals = matches!(
        arguments.command,
        Command::Run(_)
            | Command::Metrics(_)
            | Command::Top(_)
            | Command::Sim(_)
            | Command::Study(_)
            | Command::Demo(_)
            | Command::Replay(_)
    );
    if !sees_to_signals && let Err(error) = didim::signals::end_on_signal() {
        return CliError::failed(error).report();
    }
    let outcome = match arguments.command {
        Command::Demo(arguments) => demo::execute(&arguments),
        Command::Run(arguments) => run::execute(&arguments),
        Command::Sim(arguments) => sim::execute(&arguments),
        Command::Replay(arguments) => replay::execute(&arguments),
        Command::New(arguments) => new::execute(&arguments),
        Command::Robot(arguments) => robot::execute(&arguments),
        Command::Identify(arguments) => identify::execute(&arguments),
        Command::Predict(arguments) => predict::execute(&arguments),
        Command::Payload(arguments) => payload::execute(&arguments),
        Command::Gains(arguments) => gains::execute(&arguments),
        Command::Export(arguments) => export::execute(&arguments),
        Command::Advise(arguments) => advise::execute(&arguments),
        Command::Design(arguments) => design::execute(&arguments),
        Command::Compare(arguments) => compare::execute(&arguments),
        Command::Study(arguments) => study::execute(&arguments),
        Command::Convert(arguments) => convert::execute(&arguments),
        Command::Status(arguments) => status::execute(&arguments),
        Command::Metrics(arguments) => metrics::execute(&arguments),
        Command::Capture(arguments) => capture::execute(&arguments),
        Command::Top(arguments) => top::execute(&arguments),
        Command::Window(arguments) => window::execute(&arguments),
        Command::Reload(arguments) => reload::execute(&arguments),
        Command::Note(arguments) => note::execute(&arguments),
        Command::History(arguments) => history::execute(&arguments),
        Command::Fleet(arguments) => fleet::execute(&arguments),
        Command::Baseline(arguments) => baseline::execute(&arguments),
        Command::Check(arguments) => check::execute(&arguments),
        Command::Manual(arguments) => manual::execute(&arguments, command()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

/// Whether the cell is the one that is taken where none is named.
fn takes_default(matches: &ArgMatches) -> bool {
    let of_command = matches.subcommand().map(|(_, of)| of);
    let named = of_command.filter(|of| of.try_contains_id("cell").is_ok());
    named.is_some_and(|of| of.value_source("cell") == Some(ValueSource::DefaultValue))
}

/// Logs go to stderr, so that stdout carries results only. `RUST_LOG` chooses what is logged: levels by
/// module, as `warn,didim=debug`.
fn log_to_stderr(usual: LevelFilter) {
    use tracing_subscriber::filter::Targets;
    use tracing_subscriber::prelude::*;

    let chosen = std::env::var("RUST_LOG").ok().filter(|filter| !filter.is_empty());
    let chosen = chosen.and_then(|filter| filter.parse().ok());
    let filter: Targets = chosen.unwrap_or_else(|| {
        Targets::new()
            .with_default(LevelFilter::WARN)
            // The library of the stream warns, with all its memory, of an end that goes while another comes.
            .with_target("iceoryx2_bb_loggers", LevelFilter::ERROR)
            .with_target("didim", usual)
    });
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(|| progress::Beside)
        // Of a stderr that is closed or full there is nobody to tell.
        .log_internal_errors(false)
        .with_ansi(terminal::coloured(&std::io::stderr()))
        .with_target(false);
    tracing_subscriber::registry().with(lines).with(filter).init();
}
