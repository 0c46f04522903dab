//! `didim history`: shows the results over time, compares them with the baseline, and compares two
//! of them with each other.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::CliError;
use crate::input::Samples;
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, print_json, write_text, write_whole};
use crate::state::WhichState;
use crate::stream::InputFileOrStream;
use crate::terminal::{max_line_width, print_for_terminal, width};
use didim::analysis::{
    JointDifference, StoredModel, measurement_pairs, read_result_line, torque_difference,
};
use didim::archive::drift::{Baseline, DriftOptions, JudgedHistory};
use didim::archive::events::{Event, read_events};
use didim::archive::store::{HistoryLine, result_file};
use didim::report::history::{
    Difference, HistoryDocument, LongRows, plot, summary, table, write_long_table,
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
    /// Compare two results side by side: two numbers of the history, or two result files
    #[arg(long, num_args = 2, value_names = ["A", "B"])]
    compare: Vec<String>,
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
    /// With --out *.csv: write a row for each result, its parameters as arrays of PostgreSQL
    #[arg(long, requires = "out", conflicts_with = "parameter")]
    compact: bool,
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
    if arguments.compact && format == Some(LongFormat::Parquet) {
        let problem = "--compact is for *.csv: Parquet is compact already";
        return Err(CliError::Usage(problem.to_owned()));
    }
    let rows = if arguments.compact { LongRows::Results } else { LongRows::Parameters };
    let compared = ComparedResults::parse(&arguments.compare, &folder);
    let mut history = match &compared {
        Some(ComparedResults { files, are_files: true, .. }) => {
            let lines = read_result_lines(files)?;
            JudgedHistory::new(lines.to_vec(), None, options)
        }
        of => read_folder(&folder, options, of.as_ref().map_or(&[], |of| &of.numbers[..]))?,
    };
    let names: Vec<String> = history.parameters().into_iter().map(str::to_owned).collect();
    if let Some(unknown) = arguments.parameter.iter().find(|name| !names.contains(name)) {
        return Err(CliError::Usage(format!(
            "no result has the parameter `{unknown}`; known: {}",
            names.join(" ")
        )));
    }
    let difference = compared.as_ref().map(|of| of.difference(arguments, &history)).transpose()?;
    // Results are removed only after the history is complete, because each result is judged with
    // all earlier results, including those that are not shown.
    if let Some(last) = arguments.last.and_then(|last| usize::try_from(last).ok()) {
        history.keep_last(last);
    }
    let chosen = if arguments.parameter.is_empty() { &names } else { &arguments.parameter };
    let chosen: Vec<&str> = chosen.iter().map(String::as_str).collect();
    if let Some(path) = &arguments.report {
        let report = HistoryReport { history: &history, parameters: &chosen };
        write_text(path, &report.to_html())?;
    }
    if let (Some(path), Some(format)) = (&arguments.out, format) {
        write_whole(path, |out| {
            write_long_table(&history, (format, rows), &chosen, out)
                .map_err(|error| CliError::in_file(path, error))
        })?;
    }
    if arguments.json {
        return print_json(&HistoryDocument::new(&history, &chosen, difference));
    }
    if let (Some(difference), Some(compared)) = (difference, compared) {
        return print_for_terminal(&(compared.legend() + &difference.table()));
    }
    print_table(&history)?;
    let mut text = "\n".to_owned() + &summary(&history);
    for name in &arguments.parameter {
        text += "\n";
        text += &plot(&history, name, width())
            .unwrap_or_else(|| format!("{name}: no applicable result with a known time has it\n"));
        let sentence = history.tracker.as_ref().and_then(|tracker| tracker.sentence(name));
        text += &sentence.map_or(String::new(), |sentence| format!("{sentence}\n"));
    }
    print_for_terminal(&text)?;
    print_note(&NextCommand::with_report(arguments.report.as_ref(), false));
    Ok(())
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

/// Number of characters of the table that are printed at once.
const PRINTED_AT_ONCE: usize = 1 << 16;

/// Prints the results, some at a time.
fn print_table(history: &JudgedHistory) -> Result<(), CliError> {
    let (mut text, mut printed) = (String::new(), Ok(()));
    let written = table(history, max_line_width(), |line| {
        text += line;
        if text.len() >= PRINTED_AT_ONCE && printed.is_ok() {
            printed = print_for_terminal(&text);
            text.clear();
        }
    });
    written.map_err(CliError::from_failure)?;
    printed?;
    print_for_terminal(&text)
}

/// Reads the history of a folder and judges it. The requested results are found by their numbers.
fn read_folder(
    folder: &Path,
    options: DriftOptions,
    requested: &[u64],
) -> Result<JudgedHistory, CliError> {
    let baseline = Baseline::read(folder).map_err(CliError::from_failure)?;
    let history = JudgedHistory::read(folder, baseline, options, requested);
    history.map_err(CliError::from_failure)
}

/// Reads two result files as the results 1 and 2 of a history.
fn read_result_lines(files: &[PathBuf; 2]) -> Result<[HistoryLine; 2], CliError> {
    let read = |file: &Path, number| read_result_line(file, number);
    let [first, second] = [read(&files[0], 1), read(&files[1], 2)];
    Ok([first.map_err(CliError::from_failure)?, second.map_err(CliError::from_failure)?])
}

/// The two results of `--compare`.
struct ComparedResults {
    numbers: [u64; 2],
    files: [PathBuf; 2],
    /// True if files are compared, and not results of the history.
    are_files: bool,
}

impl ComparedResults {
    /// Takes two numbers as results of the history, and anything else as files. `None` if nothing
    /// is compared.
    fn parse(names: &[String], folder: &Path) -> Option<Self> {
        let [first, second] = names else { return None };
        Some(match (first.parse(), second.parse()) {
            (Ok(then), Ok(now)) => {
                let numbers = [then, now];
                let files = numbers.map(|number| result_file(folder, number));
                Self { numbers, files, are_files: false }
            }
            _ => {
                Self { numbers: [1, 2], files: [first, second].map(PathBuf::from), are_files: true }
            }
        })
    }

    fn difference(
        &self,
        arguments: &Arguments,
        history: &JudgedHistory,
    ) -> Result<Difference, CliError> {
        let difference = Difference::new(history, self.numbers).map_err(CliError::from_failure)?;
        Ok(Difference { torques: torques(arguments, &self.files)?, ..difference })
    }

    /// Names the files that the numbers in a table stand for. Empty for results of the history.
    fn legend(&self) -> String {
        let names = self.numbers.iter().zip(&self.files).filter(|_| self.are_files);
        names.map(|(number, file)| format!("result {number}: {}\n", file.display())).collect()
    }
}

/// Computes the torque difference of two results along a recording, if a recording is given.
fn torques(arguments: &Arguments, files: &[PathBuf; 2]) -> Result<Vec<JointDifference>, CliError> {
    let (Some(input), Some(cell)) = (&arguments.along, arguments.state.read_cell()?) else {
        return Ok(Vec::new());
    };
    let input = InputFileOrStream::open(input)?;
    let parts = Samples::default().read(&input, &cell)?;
    let read = |file: &Path| {
        StoredModel::read_stored_model(file, cell.clone()).map_err(CliError::from_failure)
    };
    let [(then, earlier), (now, later)] = [read(&files[0])?, read(&files[1])?];
    torque_difference([(&then, &earlier), (&now, &later)], &measurement_pairs(&parts))
        .map_err(|error| CliError::in_file(input.displayed_path(), error))
}
