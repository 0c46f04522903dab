//! `didim check`: what would not work, said before the service is started.

use std::path::PathBuf;

use clap::Args;
use didim_core::control::SimulatedController;
use serde::Serialize;

use super::CliError;
use super::output::{number, print};
use didim::cell::{Cell, CellError, OpenKey, WrongKey};
use didim::check::{Finding, Machine, Severity, check_cell, check_machine};
use didim::text::significant;

/// Version of the object that `--json` prints.
const SCHEMA: u32 = 1;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE")]
    cell: PathBuf,
    /// The cell is for another machine: do not check this one
    #[arg(long)]
    elsewhere: bool,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Answer<'a> {
    schema: u32,
    /// Nothing when the file could not be read so far.
    cell: Option<&'a str>,
    /// Whether there is no error.
    sound: bool,
    findings: &'a [Finding],
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    // What runs for years has to be of one model.
    let decided =
        |cell: Cell| if cell.bus().is_ok() { cell.decided(&arguments.cell) } else { Ok(cell) };
    let cell = match Cell::read(&arguments.cell).and_then(decided) {
        Ok(cell) => cell,
        Err(error) => {
            if arguments.json {
                print_json(None, &refused(&error))?;
            }
            return Err(CliError::configuration(error));
        }
    };
    let own = check_cell(&cell);
    let here =
        if arguments.elsewhere { Vec::new() } else { check_machine(&cell, &Machine::default()) };
    let found = [own.as_slice(), here.as_slice()].concat();
    let errors = count(&found, Severity::Error);
    if arguments.json {
        print_json(Some(&cell.name), &found)?;
    } else {
        print(&text(&cell, &own, &here, arguments.elsewhere))?;
    }
    if errors == 0 {
        return Ok(());
    }
    Err(CliError::configuration(format!(
        "{}: {}; the cell will not work",
        arguments.cell.display(),
        number(errors, "error")
    )))
}

fn print_json(cell: Option<&str>, findings: &[Finding]) -> Result<(), CliError> {
    let sound = count(findings, Severity::Error) == 0;
    let answer = Answer { schema: SCHEMA, cell, sound, findings };
    let json = serde_json::to_string(&answer).map_err(CliError::failed)?;
    print(&format!("{json}\n"))
}

/// What could not be read, as findings.
fn refused(error: &CellError) -> Vec<Finding> {
    let key = match error {
        CellError::Open { open, wrong, .. } => {
            let finding = |key: &OpenKey| {
                let what = key.what.clone().unwrap_or_else(|| "no value".to_owned());
                Finding::error(&key.key, what, format!("put a value into line {}", key.line))
            };
            let mistyped = |key: &WrongKey| {
                let remedy = format!("correct the value in line {}", key.line);
                Finding::error(&key.key, key.problem.clone(), remedy)
            };
            return open.iter().map(finding).chain(wrong.iter().map(mistyped)).collect();
        }
        CellError::Value { key, .. } => key.as_str(),
        CellError::Named { key, .. } => key,
        CellError::Robot { .. } | CellError::Urdf { .. } | CellError::BaseParameters { .. } => {
            "robot"
        }
        CellError::Layout { .. } => "bus.layout",
        CellError::Drives { .. } => "bus.drives",
        CellError::Axes { .. } => "bus.layout.axes",
        CellError::NoBus { .. } => "bus",
        CellError::Read { .. } | CellError::Cell { .. } => "",
    };
    vec![Finding::error(key, error.to_string(), "correct the file and check again")]
}

fn text(cell: &Cell, own: &[Finding], here: &[Finding], elsewhere: bool) -> String {
    let mut text = summary(cell);
    text += &controller(cell);
    for (drive, axis) in cell.bus().into_iter().flat_map(|bus| &bus.drives).zip(1..) {
        text += &format!(
            "drive {axis}: position gain from {}; torque gain from {}\n",
            drive.position.provenance.as_str(),
            drive.torque.provenance.as_str()
        );
    }
    text += "\n";
    text += &section("the configuration", own);
    if !elsewhere {
        text += "\n";
        text += &section("this machine", here);
    }
    text
}

fn summary(cell: &Cell) -> String {
    let chosen = cell.options.parameters.as_ref().map_or(cell.base.names().len(), Vec::len);
    let source = match cell.bus() {
        Ok(bus) => {
            let buses: Vec<String> = bus.sources.iter().map(ToString::to_string).collect();
            format!("bus {}: {} messages", buses.join(" "), bus.layout.messages().len())
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

/// One line that says how it is, and below it each finding with its remedy.
fn section(what: &str, findings: &[Finding]) -> String {
    let counts: Vec<String> =
        [(Severity::Error, "error"), (Severity::Warning, "warning"), (Severity::Note, "note")]
            .into_iter()
            .map(|(severity, name)| (count(findings, severity), name))
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| number(count, name))
            .collect();
    let judged = match count(findings, Severity::Error) {
        0 if what == "the configuration" => "the configuration is valid".to_owned(),
        0 => format!("{what} is suitable"),
        _ => format!("{what} is not suitable"),
    };
    let mut text = match counts.is_empty() {
        true => format!("{judged}\n"),
        false => format!("{judged}: {}\n", counts.join(", ")),
    };
    let width = findings.iter().map(|finding| finding.key.len()).max().unwrap_or(0);
    for Finding { severity, key, what, remedy } in findings {
        text += &format!("  {severity:7}  {key:width$}  {what}\n");
        text += &format!("  {:7}  {:width$}  → {remedy}\n", "", "");
    }
    text
}

fn count(findings: &[Finding], severity: Severity) -> usize {
    findings.iter().filter(|finding| finding.severity == severity).count()
}

/// What simulates the loop, and what it follows.
fn controller(cell: &Cell) -> String {
    let Some(controller) = &cell.options.controller else {
        return "controller: not described; only idim-ls can identify\n".to_owned();
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
    format!("controller: {gains}, every {} µs; {follows}\n", significant(period_us, 4))
}
