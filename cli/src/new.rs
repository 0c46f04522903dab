//! `didim new`: a commented cell file from the files that an engineer has.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;

use super::CliError;
use super::output::{print, write_text};
use didim::proposal::{Answers, Entry, Evidence, Proposal, Sources, Standing, propose};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file to write; it is not there yet
    #[arg(value_name = "CELL")]
    out: PathBuf,
    /// The arm: a URDF or a robot file; a bag's /robot_description when left out
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// The link of a URDF on which the arm stands
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// The link of a URDF at which it ends
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// A table of the arm in motion (CSV); with --dbc a log or a recording of the bus
    #[arg(long, value_name = "FILE", required_unless_present_any = ["bag", "dbc"])]
    log: Option<PathBuf>,
    /// A ROS 2 bag of the arm in motion: an MCAP file, or the folder of a split bag
    #[arg(long, value_name = "FILE", conflicts_with = "log")]
    bag: Option<PathBuf>,
    /// The DBC file of the drives' bus
    #[arg(long, value_name = "FILE", conflicts_with = "bag")]
    dbc: Option<PathBuf>,
    /// Answer a question: a key of the cell file and its value, as data.side=joint; given again, further ones
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = answer)]
    answers: Vec<(String, String)>,
}

fn answer(text: &str) -> Result<(String, String), String> {
    let answer =
        text.split_once('=').map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()));
    answer.ok_or_else(|| "has to be KEY=VALUE".to_owned())
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { out, robot, base, tip, log, bag, dbc, answers } = arguments;
    let description = Evidence::description_path(out);
    let input = log.as_ref().or(bag.as_ref());
    let (robot, base, tip) = (robot.clone(), base.clone(), tip.clone());
    let (table, log) = if dbc.is_some() { (None, log.clone()) } else { (log.clone(), None) };
    let sources = Sources { robot, base, tip, table, bag: bag.clone(), dbc: dbc.clone(), log };
    let evidence = Evidence::read(sources).map_err(CliError::configuration)?;
    let taken = evidence.description.as_ref().map(|_| &description);
    if let Some(there) = [Some(out), taken].into_iter().flatten().find(|path| path.exists()) {
        let what = format!("{} is there already; name another file, or remove it", there.display());
        return Err(CliError::Usage(what));
    }
    let mut answers: Answers = answers.iter().cloned().collect();
    let mut proposal = propose(&evidence, out, &answers).map_err(CliError::configuration)?;
    if std::io::stdin().is_terminal() && std::io::stderr().is_terminal() {
        let mut passed_over = Vec::new();
        loop {
            let is_new = |entry: &&Entry| !passed_over.contains(&entry.key());
            let Some(entry) = proposal.missing().find(is_new).cloned() else { break };
            match ask(&entry)? {
                Some(value) => drop(answers.insert(entry.key(), value)),
                None => passed_over.push(entry.key()),
            }
            proposal = propose(&evidence, out, &answers).map_err(CliError::configuration)?;
        }
    }
    if let Some(urdf) = &evidence.description {
        write_text(&description, urdf)?;
    }
    write_text(out, &proposal.text())?;
    print(&summary(&proposal))?;
    let (cell, input) =
        (out.display(), input.map_or(String::new(), |input| input.display().to_string()));
    let next = match proposal.missing().count() {
        0 => format!("next: didim identify --cell {cell} --input {input} --report report.html"),
        open => format!(
            "{open} open: put them into {cell} or give them with --set; `didim check --cell {cell}` lists them"
        ),
    };
    print(&format!("\n{cell} written\n{next}\n"))
}

/// One question on the terminal; nothing where it is passed over.
fn ask(entry: &Entry) -> Result<Option<String>, CliError> {
    let mut stderr = std::io::stderr();
    let question = format!("\n{}\n{} (empty: later) = ", entry.why, entry.key());
    stderr.write_all(question.as_bytes()).map_err(CliError::failed)?;
    let mut line = String::new();
    std::io::stdin().read_line(&mut line).map_err(CliError::failed)?;
    let value = line.trim();
    Ok((!value.is_empty()).then(|| value.to_owned()))
}

/// A line for each key, what is missing last.
fn summary(proposal: &Proposal) -> String {
    let line = |entry: &Entry| {
        let said = match entry.standing {
            Standing::Missing => String::new(),
            _ => format!(" = {}", entry.value),
        };
        let why = if entry.why.is_empty() { String::new() } else { format!(": {}", entry.why) };
        format!("{:8} {}{said}{why}\n", entry.standing.as_str(), entry.key())
    };
    let (missing, known): (Vec<_>, Vec<_>) =
        proposal.entries.iter().partition(|entry| entry.standing == Standing::Missing);
    known.into_iter().chain(missing).map(line).collect()
}
