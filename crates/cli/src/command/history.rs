//! `didim history`: shows the results over time, compares them with the baseline, and compares two
//! of them with each other.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::CliError;
use crate::input::{Samples, measurement_pairs};
use crate::output::{check_outputs, print, write_text, write_whole};
use crate::state::WhichState;
use crate::stream::InputFileOrStream;
use crate::terminal::{max_line_width, print_for_terminal, width};
use didim::analysis::{JointDifference, StoredModel, torque_difference};
use didim::archive::drift::{Baseline, JudgedHistory};
use didim::archive::events::{Event, read_events};
use didim::archive::store::{read_history, result_file};
use didim::report::history::{
    Difference, HistoryDocument, identities, long_table, plot, summary, table,
};
use didim::report::html::HistoryReport;
use didim_formats::{LongFormat, LongTableError};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    state: WhichState,
    /// Plot this parameter over time; may be given more than once
    #[arg(long, value_name = "NAME")]
    parameter: Vec<String>,
    /// Compare two results side by side
    #[arg(long, num_args = 2, value_names = ["A", "B"])]
    compare: Vec<u64>,
    /// With --compare and --cell: the torque difference of the two results along a recording's
    /// motion
    #[arg(long, value_name = "FILE", requires_all = ["compare", "cell"])]
    along: Option<PathBuf>,
    /// Show changes of bus, machine and health instead of results: interfaces, silence, losses,
    /// pauses
    #[arg(long, conflicts_with_all = ["parameter", "compare", "out", "report"])]
    events: bool,
    /// Show only this number of the last results, or events
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    last: Option<u32>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write a row for each parameter of each result: *.csv, or *.parquet
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let (folder, options) = arguments.state.find()?;
    if arguments.events {
        return show_events(arguments, &folder);
    }
    let read: Vec<&Path> = arguments.along.iter().map(PathBuf::as_path).collect();
    check_outputs(arguments.report.iter().chain(&arguments.out), &read)?;
    let format_of = |path: &PathBuf| match LongFormat::from_path(path) {
        Err(error @ LongTableError::Ending) => Err(CliError::Usage(format!("--out: {error}"))),
        of => of.map_err(|error| CliError::in_file(path, error)),
    };
    let format = arguments.out.as_ref().map(format_of).transpose()?;
    let (lines, passed_over) = read_history(&folder).map_err(CliError::from_failure)?;
    if passed_over > 0 {
        tracing::warn!(
            "lines of the history skipped as incomplete, unknown or of a later version: \
             {passed_over}"
        );
    }
    let baseline = Baseline::read(&folder).map_err(CliError::from_failure)?;
    let mut history = JudgedHistory::new(lines, baseline, options);
    let names: Vec<String> = history.parameters().into_iter().map(str::to_owned).collect();
    if let Some(unknown) = arguments.parameter.iter().find(|name| !names.contains(name)) {
        return Err(CliError::Usage(format!(
            "no result has the parameter `{unknown}`; known: {}",
            names.join(" ")
        )));
    }
    let difference = match *arguments.compare.as_slice() {
        [then, now] => {
            let difference =
                Difference::new(&history, [then, now]).map_err(CliError::from_failure)?;
            let torques = torques(arguments, &folder, [then, now])?;
            Some(Difference { torques, ..difference })
        }
        _ => None,
    };
    // Results are removed only after the history is complete, because each result is judged with
    // all earlier results, including those that are not shown.
    if let Some(last) = arguments.last.and_then(|last| usize::try_from(last).ok()) {
        let surplus = history.entries.len().saturating_sub(last);
        history.entries.drain(..surplus);
    }
    let chosen = if arguments.parameter.is_empty() { &names } else { &arguments.parameter };
    let chosen: Vec<&str> = chosen.iter().map(String::as_str).collect();
    if let Some(path) = &arguments.report {
        let report = HistoryReport { history: &history, parameters: &chosen };
        write_text(path, &report.to_html())?;
    }
    if let (Some(path), Some(format)) = (&arguments.out, format) {
        let identities = identities(&history);
        let table = long_table(&history, &identities, &chosen);
        write_whole(path, |out| format.write(&table, out).map_err(CliError::from_failure))?;
    }
    if arguments.json {
        let document = HistoryDocument::new(&history, passed_over, &chosen, difference);
        let json = serde_json::to_string(&document).map_err(CliError::from_failure)?;
        return print(&format!("{json}\n"));
    }
    if let Some(difference) = difference {
        return print_for_terminal(&difference.table());
    }
    let mut text = table(&history, max_line_width()) + "\n" + &summary(&history);
    for name in &arguments.parameter {
        text += "\n";
        text += &plot(&history, name, width())
            .unwrap_or_else(|| format!("{name}: no applicable result with a known time has it\n"));
        let sentence = history.tracker.as_ref().and_then(|tracker| tracker.sentence(name));
        text += &sentence.map_or(String::new(), |sentence| format!("{sentence}\n"));
    }
    print_for_terminal(&text)
}

/// Prints the events of a results folder.
fn show_events(arguments: &Arguments, folder: &Path) -> Result<(), CliError> {
    let mut events = read_events(folder).map_err(|error| CliError::in_file(folder, error))?;
    if let Some(last) = arguments.last.and_then(|last| usize::try_from(last).ok()) {
        events.drain(..events.len().saturating_sub(last));
    }
    if arguments.json {
        let json = serde_json::to_string(&EventDocument { schema: EVENTS_SCHEMA, events: &events });
        return print(&format!("{}\n", json.map_err(CliError::from_failure)?));
    }
    if events.is_empty() {
        return print_for_terminal("no events\n");
    }
    let lines = events.iter().map(|event| format!("{}  {event}\n", event.time));
    print_for_terminal(&lines.collect::<String>())
}

/// Version of the JSON of events.
const EVENTS_SCHEMA: u32 = 1;

/// The events as one JSON object.
#[derive(Serialize)]
struct EventDocument<'a> {
    schema: u32,
    events: &'a [Event],
}

/// Computes the torque difference of two results along a recording, if a recording is given.
fn torques(
    arguments: &Arguments,
    folder: &Path,
    numbers: [u64; 2],
) -> Result<Vec<JointDifference>, CliError> {
    let (Some(input), Some(cell)) = (&arguments.along, arguments.state.read_cell()?) else {
        return Ok(Vec::new());
    };
    let input = InputFileOrStream::open(input)?;
    let parts = Samples::default().read(&input, &cell)?;
    let read = |number| {
        StoredModel::read_stored_model(&result_file(folder, number), cell.clone())
            .map_err(CliError::from_failure)
    };
    let [(then, earlier), (now, later)] = [read(numbers[0])?, read(numbers[1])?];
    torque_difference([(&then, &earlier), (&now, &later)], &measurement_pairs(&parts))
        .map_err(|error| CliError::in_file(input.displayed_path(), error))
}
