//! `didim status`: shows the state of a running service.

use std::ffi::OsStr;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::CliError;
use crate::output::{print, refuses_colour};
use didim::cell::{Cell, ServiceSection};
use didim::files::read_text;
use didim::service::paths::Paths;
use didim::service::status::{Colour, Request, fetch_snapshot, render, send_request};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    service: WhichService,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Selection of the running service.
#[derive(Debug, Args)]
pub(super) struct WhichService {
    /// The cell file of the service, which names the folder of its sockets
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// The folder of its sockets [default: the cell's, or /run/didim]
    #[arg(long, value_name = "FOLDER")]
    runtime: Option<PathBuf>,
}

impl WhichService {
    /// Sends a request to the service and prints its reply.
    pub(super) fn send_and_print(&self, request: &Request) -> Result<(), CliError> {
        let socket = self.paths()?.command_socket();
        let done = send_request(&socket, request).map_err(CliError::from_failure)?;
        if done.is_empty() { Ok(()) } else { print(&format!("{done}\n")) }
    }

    /// Returns the paths of the service's sockets.
    pub(super) fn paths(&self) -> Result<Paths, CliError> {
        let runtime = match (&self.runtime, &self.cell) {
            (Some(runtime), _) => runtime.clone(),
            (None, Some(cell)) => runtime_directory(cell)?,
            (None, None) => ServiceSection::default().runtime_directory,
        };
        Ok(Paths::with_sockets_in(&runtime))
    }
}

/// Returns the folder of the sockets that a cell file names. A mistake in another part of the file
/// does not prevent a request to a running service.
fn runtime_directory(cell: &Path) -> Result<PathBuf, CliError> {
    let error = match Cell::read(cell) {
        Ok(cell) => return Ok(cell.service.runtime_directory),
        Err(error) => error,
    };
    let keys = read_text(cell).ok().and_then(|text| text.parse::<toml::Table>().ok());
    let Some(keys) = keys else { return Err(CliError::from_configuration(error)) };
    let named = match keys.get("service").and_then(|service| service.get("runtime_directory")) {
        Some(toml::Value::String(folder)) => PathBuf::from(folder),
        Some(_) => return Err(CliError::from_configuration(error)),
        None => ServiceSection::default().runtime_directory,
    };
    tracing::warn!("{} has mistakes; `didim check` lists them", cell.display());
    Ok(named)
}

/// Returns the use of colours: always on a terminal, unless `NO_COLOR` forbids colours; never on
/// other outputs.
fn choose_colour(is_terminal: bool, no_color: Option<&OsStr>) -> Colour {
    match is_terminal && !refuses_colour(no_color) {
        true => Colour::Always,
        false => Colour::Never,
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let snapshot = fetch_snapshot(&arguments.service.paths()?).map_err(CliError::from_failure)?;
    if arguments.json {
        let json = serde_json::to_string(&snapshot).map_err(CliError::from_failure)?;
        return print(&format!("{json}\n"));
    }
    let no_color = std::env::var_os("NO_COLOR");
    let colour = choose_colour(std::io::stdout().is_terminal(), no_color.as_deref());
    print(&render(&snapshot, colour))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_for_terminals_and_not_for_who_wants_none() {
        let shown = |is_terminal, no_color: Option<&str>| {
            matches!(choose_colour(is_terminal, no_color.map(OsStr::new)), Colour::Always)
        };
        assert!(shown(true, None) && shown(true, Some("")));
        assert!(!shown(true, Some("1")) && !shown(false, None));
    }
}
