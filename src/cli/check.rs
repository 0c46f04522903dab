//! `didim check`: what would not work, said before the service is started.

use std::path::PathBuf;

use clap::Args;

use super::CliError;
use super::output::print;
use crate::cell::{BusAddress, Cell};

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
