//! `didim new`: writes a commented cell file from the files that an engineer has.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::CliError;
use crate::names::{REPORT_FILE, RESULT_FILE};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_place, print, write_text};
use didim::analysis::check_compression;
use didim::cell::{Cell, CellError};
use didim::live::recording::is_mcap;
use didim::proposal::{Answers, Entry, Evidence, Proposal, Sources, ValueOrigin, propose};
use didim_formats::{foreign_container, is_sqlite};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file to write; it must not exist yet
    #[arg(value_name = "CELL")]
    out: PathBuf,
    /// The arm: a URDF or a robot file; default: a bag's /robot_description
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// The base link of the arm in a URDF
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// The last link of the arm in a URDF
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// A table of the arm in motion (CSV, Parquet); with --dbc or --eds, a log or a recording of
    /// the bus
    #[arg(long, value_name = "FILE", required_unless_present_any = ["bag", "dbc", "eds"])]
    log: Option<PathBuf>,
    /// A ROS 2 bag of the arm in motion: a file (MCAP, SQLite), or the folder of a bag
    #[arg(long, value_name = "FILE", conflicts_with = "log")]
    bag: Option<PathBuf>,
    /// The DBC file of the drives' bus
    #[arg(long, value_name = "FILE", conflicts_with = "bag")]
    dbc: Option<PathBuf>,
    /// A device file (EDS, DCF) of CANopen drives: one for all drives, or one for each by repeating
    /// the option
    #[arg(long, value_name = "FILE", conflicts_with_all = ["bag", "dbc"])]
    eds: Vec<PathBuf>,
    /// Answer a question with a key of the cell file and its value, as data.side=joint; repeat for
    /// more answers
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_answer)]
    answers: Vec<(String, String)>,
}

fn parse_answer(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or_else(|| "has to be KEY=VALUE".to_owned())?;
    Ok(answer_of(key.trim(), value.trim()))
}

/// Keys of columns that a list may answer.
const COLUMN_KEYS: [&str; 3] =
    ["data.position.column", "data.torque.column", "data.reference.column"];

/// Returns the key that an answer is for, and its value. A list of columns, with its name or
/// without, is for `columns`; words in it need no quotes.
fn answer_of(key: &str, value: &str) -> (String, String) {
    let named = value.strip_prefix("columns").map(str::trim_start);
    let list = named.and_then(|rest| rest.strip_prefix('=')).unwrap_or(value).trim();
    let parts = list.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let Some(parts) = parts.filter(|_| COLUMN_KEYS.contains(&key)) else {
        return (key.to_owned(), value.to_owned());
    };
    let column = |part: &str| match part.trim().trim_matches(['"', '\'']) {
        number if number.parse::<u16>().is_ok() => number.to_owned(),
        name => format!("{name:?}"),
    };
    let columns = parts.split(',').map(column).collect::<Vec<_>>().join(", ");
    (format!("{key}s"), format!("[{columns}]"))
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { out, robot, base, tip, log, bag, dbc, eds, answers } = arguments;
    let description = Evidence::description_path(out);
    let input = log.as_ref().or(bag.as_ref());
    let (robot, base, tip) = (robot.clone(), base.clone(), tip.clone());
    let is_bus = dbc.is_some() || !eds.is_empty();
    let is_bag =
        log.as_ref().is_some_and(|log| !is_bus && (log.is_dir() || is_mcap(log) || is_sqlite(log)));
    if is_bag {
        let explanation = "--log is a table, and this is a bag; name it with --bag, or the bus \
            with --dbc or --eds";
        return Err(CliError::Usage(explanation.to_owned()));
    }
    if let Some((log, container)) =
        log.as_ref().and_then(|log| Some((log, foreign_container(log)?)))
    {
        return Err(CliError::in_file(log, container));
    }
    if let Some(log) = log.as_ref().filter(|_| is_bus) {
        check_compression(log).map_err(CliError::from_failure)?;
    }
    let (table, log) = if is_bus { (None, log.clone()) } else { (log.clone(), None) };
    let (bag, dbc, eds) = (bag.clone(), dbc.clone(), eds.clone());
    let sources = Sources { robot, base, tip, table, bag, dbc, eds, log };
    // Check before the questions, so that no answers are lost.
    check_place(out)?;
    let evidence = Evidence::read(sources).map_err(CliError::from_configuration)?;
    let taken = evidence.description.as_ref().map(|_| &description);
    if taken == Some(out) {
        let explanation = "the bag's URDF is written under this name; give the cell another \
            ending, such as .toml";
        return Err(CliError::Usage(explanation.to_owned()));
    }
    if let Some(there) = [Some(out), taken].into_iter().flatten().find(|path| path.exists()) {
        let explanation =
            format!("{} is there already; name another file, or remove it", there.display());
        return Err(CliError::Usage(explanation));
    }
    let mut answers: Answers = answers.iter().cloned().collect();
    let mut proposal = propose(&evidence, out, &answers).map_err(CliError::from_configuration)?;
    if std::io::stdin().is_terminal() && std::io::stderr().is_terminal() {
        ask_questions(&evidence, out, &mut answers, &mut proposal)?;
    }
    write_cell(&evidence, out, &proposal)?;
    print(&summary(&proposal))?;
    print(&format!("\n{} written\n{}", out.display(), next_steps(out, input, &proposal)))
}

/// Writes the cell file, and the robot description of a bag next to it. A cell that the other
/// commands refuse is not written: an answer may have another type or length than its key needs.
fn write_cell(evidence: &Evidence, out: &Path, proposal: &Proposal) -> Result<(), CliError> {
    let description =
        evidence.description.as_ref().map(|urdf| (Evidence::description_path(out), urdf));
    if let Some((path, urdf)) = &description {
        write_text(path, urdf)?;
    }
    if let Some(mistake) = find_mistake(proposal, out) {
        if let Some((path, _)) = &description {
            std::fs::remove_file(path).map_err(|error| CliError::in_file(path, error))?;
        }
        return Err(CliError::from_configuration(mistake));
    }
    write_text(out, &proposal.text())
}

/// Asks the open questions on the terminal. Each answer is checked at once.
fn ask_questions(
    evidence: &Evidence,
    out: &Path,
    answers: &mut Answers,
    proposal: &mut Proposal,
) -> Result<(), CliError> {
    let mut passed_over = Vec::new();
    loop {
        let is_new = |entry: &&Entry| !passed_over.contains(&entry.key());
        let Some(entry) = proposal.missing().into_iter().find(is_new).cloned() else {
            return Ok(());
        };
        let key = entry.key();
        let Some(value) = ask_question(&entry)? else {
            passed_over.push(key);
            continue;
        };
        let (key, value) = answer_of(&key, &value);
        answers.insert(key.clone(), value);
        let with_it = propose(evidence, out, answers).map_err(|error| error.to_string());
        let with_it =
            with_it.and_then(|with_it| match mistake_of(&key, [proposal, &with_it], out) {
                Some(mistake) => Err(mistake),
                None => Ok(with_it),
            });
        match with_it {
            Ok(with_it) => *proposal = with_it,
            // A mistake discards one answer, not all of them.
            Err(mistake) => {
                answers.remove(&key);
                print_note(&format!("{mistake}\n"));
            }
        }
    }
}

/// Returns the mistake that the other commands would find in the proposed cell. Open values are
/// none, and the others are checked with valid values in their place.
fn find_mistake(proposal: &Proposal, out: &Path) -> Option<CellError> {
    match Cell::check_text(proposal.text(), out) {
        Ok(()) => None,
        Err(CellError::Open { wrong, .. }) if wrong.is_empty() => {
            let error = Cell::check_text(proposal.text_for_check()?, out).err();
            error.filter(|error| !matches!(error, CellError::Open { .. }))
        }
        Err(error) => Some(error),
    }
}

/// Returns the mistake that an answer adds to a proposal: in the value of its key, or in the
/// complete cell, which had none before.
fn mistake_of(key: &str, [before, after]: [&Proposal; 2], out: &Path) -> Option<String> {
    match find_mistake(after, out)? {
        CellError::Open { wrong, .. } => {
            wrong.iter().find(|wrong| wrong.key == key).map(|wrong| wrong.problem.clone())
        }
        error => find_mistake(before, out).is_none().then(|| error.to_string()),
    }
}

/// Returns what to do with the cell file.
fn next_steps(out: &Path, input: Option<&PathBuf>, proposal: &Proposal) -> String {
    match (proposal.missing().len(), input) {
        (0, Some(input)) => NextCommand::new("identify")
            .with_option("--cell", out)
            .with_option("--input", input)
            .with_option("--out", RESULT_FILE)
            .with_option("--report", REPORT_FILE)
            .to_string(),
        (0, None) => NextCommand::new("check").with_option("--cell", out).to_string(),
        (open, _) => format!(
            "{open} open: put them into {} or give them with --set, the first ones first; they \
            often settle the others\n{}",
            out.display(),
            NextCommand::new("check").with_option("--cell", out)
        ),
    }
}

/// Asks one question on the terminal; returns `None` if it is skipped.
fn ask_question(entry: &Entry) -> Result<Option<String>, CliError> {
    print_note(&format!("\n{}\n{} (empty: later) = ", entry.explanation, entry.key()));
    let mut line = String::new();
    std::io::stdin().read_line(&mut line).map_err(CliError::from_failure)?;
    let value = line.trim();
    Ok((!value.is_empty()).then(|| value.to_owned()))
}

/// Returns one line per key, with the missing keys last.
fn summary(proposal: &Proposal) -> String {
    let is_answered = |entry: &&Entry| entry.origin != ValueOrigin::Missing;
    let answered = proposal.entries.iter().filter(is_answered);
    answered
        .chain(proposal.missing())
        .map(|entry: &Entry| {
            let said = match entry.origin {
                ValueOrigin::Missing => String::new(),
                _ => format!(" = {}", entry.value),
            };
            let why = if entry.explanation.is_empty() {
                String::new()
            } else {
                format!(": {}", entry.explanation)
            };
            format!("{:8} {}{said}{why}\n", entry.origin.as_str(), entry.key())
        })
        .collect()
}
