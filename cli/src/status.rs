//! `didim status`: what a running service knows.

use std::ffi::OsStr;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use super::output::{print, refuses_colour};
use didim::cell::{Cell, ServiceSection};
use didim::files::read_text;
use didim::service::paths::Paths;
use didim::service::status::{Colour, Request, fetch, render, send_request};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    service: WhichService,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Which running service is meant.
#[derive(Debug, Args)]
pub(super) struct WhichService {
    /// The cell file of the service, for the folder of its sockets
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// The folder of its sockets [default: the cell's, or /run/didim]
    #[arg(long, value_name = "FOLDER")]
    runtime: Option<PathBuf>,
}

impl WhichService {
    /// Has a request done and prints what the service says of it.
    pub(super) fn ask(&self, request: &Request) -> Result<(), CliError> {
        let socket = self.paths()?.command_socket();
        let done = send_request(&socket, request).map_err(CliError::failed)?;
        if done.is_empty() { Ok(()) } else { print(&format!("{done}\n")) }
    }

    /// Where its sockets are.
    pub(super) fn paths(&self) -> Result<Paths, CliError> {
        let runtime = match (&self.runtime, &self.cell) {
            (Some(runtime), _) => runtime.clone(),
            (None, Some(cell)) => runtime_directory(cell)?,
            (None, None) => ServiceSection::default().runtime_directory,
        };
        Ok(Paths::with_sockets_in(&runtime))
    }
}

/// The folder that a cell file names. A mistake elsewhere in the file is no obstacle to asking a service that runs.
fn runtime_directory(cell: &Path) -> Result<PathBuf, CliError> {
    let error = match Cell::read(cell) {
        Ok(cell) => return Ok(cell.service.runtime_directory),
        Err(error) => error,
    };
    let keys = read_text(cell).ok().and_then(|text| text.parse::<toml::Table>().ok());
    let Some(keys) = keys else { return Err(CliError::configuration(error)) };
    let named = match keys.get("service").and_then(|service| service.get("runtime_directory")) {
        Some(toml::Value::String(folder)) => PathBuf::from(folder),
        Some(_) => return Err(CliError::configuration(error)),
        None => ServiceSection::default().runtime_directory,
    };
    tracing::warn!("{} has mistakes; `didim check` lists them", cell.display());
    Ok(named)
}

/// Colour for people: on a terminal, unless `NO_COLOR` asks for none.
fn colour(is_terminal: bool, no_color: Option<&OsStr>) -> Colour {
    match is_terminal && !refuses_colour(no_color) {
        true => Colour::Always,
        false => Colour::Never,
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let snapshot = fetch(&arguments.service.paths()?).map_err(CliError::failed)?;
    if arguments.json {
        let json = serde_json::to_string(&snapshot).map_err(CliError::failed)?;
        return print(&format!("{json}\n"));
    }
    let no_color = std::env::var_os("NO_COLOR");
    let colour = colour(std::io::stdout().is_terminal(), no_color.as_deref());
    print(&render(&snapshot, colour))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_for_terminals_and_not_for_who_wants_none() {
        let shown = |is_terminal, no_color: Option<&str>| {
            matches!(colour(is_terminal, no_color.map(OsStr::new)), Colour::Always)
        };
        assert!(shown(true, None) && shown(true, Some("")));
        assert!(!shown(true, Some("1")) && !shown(false, None));
    }
}
