//! `didim check`: finds problems before the service is started.

use std::path::{Path, PathBuf};

use clap::Args;
use didim_drivers::units::DriveSpec;
use didim_dynamics::control::SimulatedController;
use serde::Serialize;

use crate::CliError;
use crate::names::DEFAULT_CELL;
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{count_with_noun, print};
use crate::terminal::print_for_terminal;
use didim::cell::{Cell, CellError, Faults, Library, OpenKey, WrongKey};
use didim::check::{Finding, Machine, Severity, check_cell, check_machine, writing_text};
use didim::text::significant_digits;

/// Version of the object that `--json` prints.
const SCHEMA: u32 = 1;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The cell is for another machine: do not check this one
    // The old name is accepted until version 1.0.0: tests/words/kept.toml.
    #[arg(long, alias = "elsewhere")]
    other_machine: bool,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct JsonOutput<'a> {
    schema: u32,
    /// Name of the cell. `None` (JSON null) if the file could not be read as far as the name.
    cell: Option<&'a str>,
    /// True if there is no error.
    sound: bool,
    findings: &'a [Finding],
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = match Cell::read_all(Library::Files, &arguments.cell) {
        Ok(cell) => cell,
        Err(faults) => {
            if arguments.json {
                let findings: Vec<Finding> = faults.iter().flat_map(findings_of_error).collect();
                print_json(None, &findings)?;
            }
            return Err(from_faults(&arguments.cell, faults));
        }
    };
    let mut cell_findings = check_cell(&cell);
    // A long-running service needs a constant model, so it does not choose values from the data.
    if cell.bus().is_ok()
        && let Err(left_to_data) = cell.clone().require_decided(&arguments.cell)
    {
        cell_findings.splice(0..0, findings_of_error(&left_to_data));
    }
    let machine_findings = if arguments.other_machine {
        Vec::new()
    } else {
        check_machine(&cell, &Machine::default())
    };
    let all_findings = [cell_findings.as_slice(), machine_findings.as_slice()].concat();
    let errors = count(&all_findings, Severity::Error);
    if arguments.json {
        print_json(Some(&cell.name), &all_findings)?;
    } else {
        print_for_terminal(&text(
            &cell,
            &cell_findings,
            &machine_findings,
            arguments.other_machine,
        ))?;
    }
    if errors == 0 {
        if cell.bus().is_ok() && !arguments.json && !arguments.other_machine {
            print_note(&NextCommand::new("run").with_option("--cell", &arguments.cell).to_string());
        }
        return Ok(());
    }
    Err(CliError::from_configuration(format!(
        "{}: {}; the cell will not work",
        arguments.cell.display(),
        count_with_noun(errors, "error")
    )))
}

/// Creates an error that lists every fault of an invalid cell file.
fn from_faults(file: &Path, faults: Faults) -> CliError {
    if faults.further_faults.is_empty() {
        return CliError::from_configuration(*faults.first_fault);
    }
    let file = file.display().to_string();
    let count = count_with_noun(faults.iter().count(), "error");
    let list: String = faults
        .iter()
        .map(|fault: &CellError| {
            let text = fault.to_string();
            let text = text.strip_prefix(&format!("{file}: ")).unwrap_or(&text).trim_end();
            format!("\n  {}", text.replace('\n', "\n  "))
        })
        .collect();
    CliError::from_configuration(format!("{file}: {count}:{list}"))
}

fn print_json(cell: Option<&str>, findings: &[Finding]) -> Result<(), CliError> {
    let sound = count(findings, Severity::Error) == 0;
    let answer = JsonOutput { schema: SCHEMA, cell, sound, findings };
    let json = serde_json::to_string(&answer).map_err(CliError::from_failure)?;
    print(&format!("{json}\n"))
}

/// Remedy for a fault.
const CORRECT_AND_REPEAT: &str = "correct the file and check again";

/// Converts a read error to findings.
fn findings_of_error(error: &CellError) -> Vec<Finding> {
    let key = match error {
        CellError::Open { open, wrong, .. } => {
            return open
                .iter()
                .map(|key: &OpenKey| {
                    let reason = key.question.clone().unwrap_or_else(|| "no value".to_owned());
                    Finding::error(&key.key, reason, format!("put a value into line {}", key.line))
                })
                .chain(wrong.iter().map(|key: &WrongKey| {
                    let remedy = format!("correct the value in line {}", key.line);
                    Finding::error(&key.key, key.problem.clone(), remedy)
                }))
                .collect();
        }
        CellError::Value { line, key, problem, .. } => {
            let line = line.map_or_else(String::new, |line| format!("line {line}: "));
            return vec![Finding::error(key, format!("{line}{problem}"), CORRECT_AND_REPEAT)];
        }
        CellError::Named { key, .. } => key,
        CellError::Robot { .. } | CellError::Urdf { .. } | CellError::BaseParameters { .. } => {
            "robot"
        }
        CellError::Layout { .. } => "bus.layout",
        CellError::Drives { .. } => "bus.drives",
        CellError::Axes { .. } => "bus.layout.axes",
        CellError::NoBus { .. } => "bus",
        CellError::Read { .. } | CellError::Cell { .. } | CellError::OtherKind { .. } => "",
    };
    vec![Finding::error(key, error.to_string(), CORRECT_AND_REPEAT)]
}

fn text(cell: &Cell, own: &[Finding], here: &[Finding], other_machine: bool) -> String {
    let mut text = summary(cell);
    text += &controller_text(cell);
    text += &drives(cell);
    text += &writing_text(cell).unwrap_or_default();
    text += "\n";
    text += &verdict_line("the configuration", own);
    if !other_machine {
        text += &verdict_line("this machine", here);
    }
    let findings = [own, here].concat();
    for (severity, heading) in SEVERITY_GROUPS {
        text += &severity_section(
            heading,
            findings.iter().filter(|finding| finding.severity == severity),
        );
    }
    text
}

/// Lists the provenance of the position and torque gains. Consecutive drives with the same
/// provenance share a line.
fn drives(cell: &Cell) -> String {
    let drives = cell.bus().map_or(&[][..], |bus| &bus.drives);
    let said = |drive: &DriveSpec| {
        let (position, torque) = (&drive.position.provenance, &drive.torque.provenance);
        format!("position gain from {}; torque gain from {}\n", position.as_str(), torque.as_str())
    };
    let mut first = 1;
    let alike = drives.chunk_by(|one, next| said(one) == said(next));
    alike
        .map(|alike: &[DriveSpec]| {
            let last = first + alike.len() - 1;
            let named = if first == last {
                format!("drive {first}")
            } else {
                format!("drives {first} to {last}")
            };
            first = last + 1;
            format!("{named}: {}", alike.first().map(said).unwrap_or_default())
        })
        .collect()
}

fn summary(cell: &Cell) -> String {
    let chosen = cell.options.parameters.as_ref().map_or(cell.base.names().len(), Vec::len);
    let source = match cell.bus() {
        Ok(bus) => {
            let buses: Vec<String> = bus.sources.iter().map(ToString::to_string).collect();
            format!(
                "bus {}: {}",
                buses.join(" "),
                count_with_noun(bus.layout.messages().len(), "message")
            )
        }
        Err(_) if cell.bag.is_some() => "no bus: ROS 2 bags".to_owned(),
        Err(_) if cell.columns.is_some() => "no bus: tables with the columns of [data]".to_owned(),
        Err(_) => "no bus: tables with didim's own columns".to_owned(),
    };
    format!(
        "cell {}: {} with {} joints, {} base parameters, {chosen} to be identified by {}\n\
         {source}, {:.0} samples/s, {}\n",
        cell.name,
        cell.robot.name(),
        cell.robot.joints(),
        cell.base.names().len(),
        cell.method,
        cell.sample_rate_hz(),
        match (cell.has_reference(), cell.bus().is_err() && cell.columns.is_none()) {
            (true, true) => "with reference where a table has one",
            (true, false) => "with reference",
            (false, _) => "without reference",
        },
    )
}

/// Groups of findings in the output, the most severe first.
const SEVERITY_GROUPS: [(Severity, &str); 3] =
    [(Severity::Error, "error"), (Severity::Warning, "warning"), (Severity::Note, "note")];

/// Returns one line with the verdict.
fn verdict_line(what: &str, findings: &[Finding]) -> String {
    let counts: Vec<String> = SEVERITY_GROUPS
        .into_iter()
        .map(|(severity, name)| (count(findings, severity), name))
        .filter(|(count, _)| *count > 0)
        .map(|(count, name)| count_with_noun(count, name))
        .collect();
    let judged = match count(findings, Severity::Error) {
        0 if what == "the configuration" => "the configuration is valid".to_owned(),
        0 => format!("{what} is suitable"),
        _ => format!("{what} is not suitable"),
    };
    match counts.is_empty() {
        true => format!("{judged}\n"),
        false => format!("{judged}: {}\n", counts.join(", ")),
    }
}

/// Lists the findings of one severity, each with its remedy.
fn severity_section<'a>(
    heading: &str,
    findings: impl Iterator<Item = &'a Finding> + Clone,
) -> String {
    let width = findings.clone().map(|finding| finding.key.len()).max().unwrap_or(0);
    let shown = |Finding { key, what, remedy, .. }: &Finding| {
        format!("  {key:width$}  {what}\n  {:width$}  → {remedy}\n", "")
    };
    let listed: Vec<String> = findings.map(shown).collect();
    match listed.len() {
        0 => String::new(),
        1 => format!("\n{heading}\n{}", listed.concat()),
        _ => format!("\n{heading}s\n{}", listed.concat()),
    }
}

fn count(findings: &[Finding], severity: Severity) -> usize {
    findings.iter().filter(|finding| finding.severity == severity).count()
}

/// Describes the controller of the simulated loop and its reference.
fn controller_text(cell: &Cell) -> String {
    let Some(controller) = &cell.options.controller else {
        return match cell.has_commanded_law() {
            true => "controller: the law of the commands, where it stays along the record\n",
            false => "controller: not described; only idim-ls can identify\n",
        }
        .to_owned();
    };
    let gains = match controller {
        SimulatedController::Cabinet { rescale_to_inertia_kg_m2: None, .. } => {
            "the cabinet's gains, fixed"
        }
        SimulatedController::Cabinet { .. } => "the cabinet's gains, rescaled with the estimate",
        SimulatedController::Bandwidth { .. } => "gains of a stated bandwidth",
    };
    let period_us = 1e6 * controller.timing().sample_period_s();
    let follows = if cell.has_reference() {
        "follows the recorded reference"
    } else {
        "follows the measured position, as there is no reference: the result is nearly that of \
         idim-ls"
    };
    format!("controller: {gains}, every {} µs; {follows}\n", significant_digits(period_us, 4))
}
