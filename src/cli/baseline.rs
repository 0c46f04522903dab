//! `didim baseline`: the result that later ones are compared with.

use std::path::Path;

use clap::{Args, Subcommand};

use super::CliError;
use super::output::print;
use super::state::WhichState;
use crate::drift::Baseline;
use crate::report::table::{aligned, significant, to_uncertainty};
use crate::store::{HistoryLine, read_history};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Compare later results with this one; a running service does so from now on
    Set {
        /// Number of the result [default: the last applicable one]
        result: Option<u64>,
        #[command(flatten)]
        state: WhichState,
    },
    /// Compare with none
    Clear {
        #[command(flatten)]
        state: WhichState,
    },
    /// Show it
    Show {
        #[command(flatten)]
        state: WhichState,
    },
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.action {
        Action::Set { result, state } => {
            let folder = state.find()?.0;
            let baseline = Baseline::of(choose(&folder, *result)?);
            baseline.write(&folder).map_err(CliError::failed)?;
            let HistoryLine { result, time, .. } = baseline.result;
            print(&format!("result {result} of {time} is the baseline\n"))
        }
        Action::Clear { state } => {
            let removed = Baseline::remove(&state.find()?.0).map_err(CliError::failed)?;
            print(if removed {
                "there is no baseline any more\n"
            } else {
                "there was no baseline\n"
            })
        }
        Action::Show { state } => {
            let folder = state.find()?.0;
            match Baseline::read(&folder).map_err(CliError::failed)? {
                Some(baseline) => print(&text(&baseline)),
                None => Err(CliError::failed(format!(
                    "{}: no baseline is set; set one with `didim baseline set`",
                    folder.display()
                ))),
            }
        }
    }
}

/// The result of that number, or the last one that may be used.
fn choose(folder: &Path, number: Option<u64>) -> Result<HistoryLine, CliError> {
    let (lines, _) = read_history(folder).map_err(CliError::failed)?;
    let known = match (lines.first(), lines.last()) {
        (Some(first), Some(last)) => format!("it has results {} to {}", first.result, last.result),
        _ => "it is empty".to_owned(),
    };
    let refuse = |why: String| Err(CliError::failed(format!("{}: {why}", folder.display())));
    // Numbers begin anew in an emptied folder: the last one of a number is meant.
    let mut newest_first = lines.into_iter().rev();
    match number {
        None => match newest_first.find(|line| line.applicable) {
            Some(line) => Ok(line),
            None => refuse(format!("no result in the history is applicable; {known}")),
        },
        Some(number) => match newest_first.find(|line| line.result == number) {
            Some(line) if line.applicable => Ok(line),
            Some(_) => refuse(format!(
                "result {number} is not applicable, and what differs from it says nothing; choose \
                 another, `didim history` lists them"
            )),
            None => refuse(format!("result {number} is not in the history; {known}")),
        },
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
                significant(p.standard_deviation, 2),
                format!("{} %", significant(relative, 2)),
            ]
        })
        .collect();
    text + "\n" + &aligned(&["parameter", "value", "σ", "relative σ"], &rows)
}
