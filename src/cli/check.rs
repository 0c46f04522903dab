//! `didim check`: what would not work, said before the service is started.

use std::path::PathBuf;

use clap::Args;
use didim_core::control::SimulatedController;

use super::CliError;
use super::output::print;
use crate::cell::{BusAddress, Cell};
use crate::report::table::significant;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE")]
    cell: PathBuf,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::configuration)?;
    let chosen = cell.options.parameters.as_ref().map_or(cell.base.names().len(), Vec::len);
    let buses: Vec<String> = cell.sources.iter().map(ToString::to_string).collect();
    let mut text = format!(
        "cell {}: {} with {} joints, {} base parameters, {chosen} to be identified by {}\n\
         bus {}: {} messages, {:.0} samples/s, {}\n",
        cell.name,
        cell.robot.name(),
        cell.robot.joints(),
        cell.base.names().len(),
        cell.method,
        buses.join(" "),
        cell.layout.messages().len(),
        cell.sample_rate_hz(),
        if cell.layout.has_reference() { "with reference" } else { "without reference" },
    );
    text += &controller(&cell);
    for (drive, axis) in cell.drives.iter().zip(1..) {
        text += &format!(
            "drive {axis}: position gain from {}; torque gain from {}\n",
            drive.position.provenance.as_str(),
            drive.torque.provenance.as_str()
        );
    }
    let missing: Vec<String> = cell
        .sources
        .iter()
        .filter_map(|source| match source {
            BusAddress::Can(name) => {
                let here = std::path::Path::new("/sys/class/net").join(name.as_str()).exists();
                (!here).then(|| format!("{source}: there is no such interface on this machine"))
            }
            BusAddress::Log(file) => {
                (!file.is_file()).then(|| format!("{source}: there is no such file"))
            }
            BusAddress::InProcess => Some(format!(
                "{source}: `didim run` has no such bus; write can:INTERFACE or log:FILE"
            )),
        })
        .collect();
    if missing.is_empty() {
        text += "the configuration is sound\n";
    } else {
        text += "the configuration is sound, but here and now:\n";
        for problem in missing {
            text += &format!("  {problem}\n");
        }
    }
    print(&text)
}

/// What simulates the loop, and what it follows.
fn controller(cell: &Cell) -> String {
    let Some(didim) = &cell.didim else {
        return "controller: not described; only idim-ls can identify\n".to_owned();
    };
    let gains = match &didim.controller {
        SimulatedController::Cabinet { rescale_to_inertia_kg_m2: None, .. } => {
            "the cabinet's gains, fixed"
        }
        SimulatedController::Cabinet { .. } => "the cabinet's gains, rescaled with the estimate",
        SimulatedController::Bandwidth { .. } => "gains of a stated bandwidth",
    };
    let period_us = 1e6 * didim.controller.timing().sample_period_s();
    let follows = if cell.layout.has_reference() {
        "follows the recorded reference"
    } else {
        "follows the measured position, as there is no reference: nearly idim-ls"
    };
    format!("controller: {gains}, every {} µs; {follows}\n", significant(period_us, 4))
}
