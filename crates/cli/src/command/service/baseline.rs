//! `didim baseline`: sets, removes or shows the result with which later results are compared.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::status::WhichService;
use crate::CliError;
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::print;
use crate::state::WhichState;
use crate::terminal::print_for_terminal;
use didim::archive::drift::{Baseline, ChooseError, set_baseline};
use didim::archive::store::HistoryLine;
use didim::service::status::{BaselineRequest, Request};
use didim::text::{align_table, significant_digits, to_uncertainty};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Compare later results with this one
    Set {
        /// Number of the result [default: the last applicable one]
        result: Option<u64>,
        #[command(flatten)]
        target: BaselineTarget,
    },
    /// Remove the baseline
    Clear {
        #[command(flatten)]
        target: BaselineTarget,
    },
    /// Show the baseline
    Show {
        #[command(flatten)]
        state: WhichState,
    },
}

/// A running service, or the folder of a stopped one.
#[derive(Debug, Args)]
struct BaselineTarget {
    #[command(flatten)]
    service: WhichService,
    /// Write to this folder of results, instead of asking a running service
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["cell", "runtime"])]
    state: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.action {
        Action::Set { result, target: BaselineTarget { service, state: None } } => {
            service.send_and_print(&Request::Baseline(BaselineRequest::Set(*result)))
        }
        Action::Set { result, target: BaselineTarget { state: Some(folder), .. } } => {
            let baseline = set_baseline(folder, *result).map_err(|why| match why {
                // These errors name the folder themselves.
                ChooseError::History(_) | ChooseError::Baseline(_) => CliError::from_failure(why),
                why => CliError::from_failure(format!("{}: {why}", folder.display())),
            })?;
            let HistoryLine { result, time, .. } = baseline.result;
            print(&format!("result {result} of {time} is the baseline\n"))?;
            print_note(&NextCommand::new("history").with_option("--state", folder).to_string());
            Ok(())
        }
        Action::Clear { target: BaselineTarget { service, state: None } } => {
            service.send_and_print(&Request::Baseline(BaselineRequest::Clear))
        }
        Action::Clear { target: BaselineTarget { state: Some(folder), .. } } => {
            let removed = Baseline::remove(folder).map_err(CliError::from_failure)?;
            print(if removed { "the baseline is cleared\n" } else { "there was no baseline\n" })
        }
        Action::Show { state } => {
            let folder = state.find()?.0;
            match Baseline::read(&folder).map_err(CliError::from_failure)? {
                Some(baseline) => print_for_terminal(&text(&baseline)),
                None => Err(CliError::from_failure(format!(
                    "{}: no baseline is set; set one with `didim baseline set`",
                    folder.display()
                ))),
            }
        }
    }
}

fn text(baseline: &Baseline) -> String {
    let line = &baseline.result;
    let mut text = format!(
        "result {} of {}, the baseline since {}\n{} on {}, configuration {}\n",
        line.result, line.time, baseline.set, line.method, line.robot, line.configuration
    );
    if let Some(note) = &line.note {
        text += &format!("noted: {}\n", note.line());
    }
    let rows: Vec<_> = (line.parameters.iter())
        .map(|p| {
            let relative = 100.0 * p.standard_deviation / p.value.abs();
            vec![
                p.name.clone(),
                to_uncertainty(p.value, p.standard_deviation, 7),
                p.unit_or_dash().to_owned(),
                significant_digits(p.standard_deviation, 2),
                format!("{} %", significant_digits(relative, 2)),
                p.description.clone().unwrap_or_default(),
            ]
        })
        .collect();
    text + "\n"
        + &align_table(
            &["parameter", "value", "unit", "σ (statistical)", "relative σ", "of"],
            &rows,
        )
}
