//! `didim status`: what a running service knows.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use super::output::print;
use didim::cell::{Cell, ServiceSection};
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
            (None, Some(cell)) => {
                Cell::read(Path::new(cell))
                    .map_err(CliError::configuration)?
                    .service
                    .runtime_directory
            }
            (None, None) => ServiceSection::default().runtime_directory,
        };
        Ok(Paths::with_sockets_in(&runtime))
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let snapshot = fetch(&arguments.service.paths()?).map_err(CliError::failed)?;
    if arguments.json {
        let json = serde_json::to_string(&snapshot).map_err(CliError::failed)?;
        return print(&format!("{json}\n"));
    }
    let colour = if std::io::stdout().is_terminal() { Colour::Always } else { Colour::Never };
    print(&render(&snapshot, colour))
}
