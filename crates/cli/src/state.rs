//! Selection of the folder of results.

use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use didim::archive::drift::DriftOptions;
use didim::cell::{Cell, ServiceSection};

/// Selection of the folder of results.
#[derive(Debug, Args)]
pub(super) struct WhichState {
    /// The cell file of the service, for the folder of its results and its drift limits
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// The folder of its results [default: the cell's, or /var/lib/didim]
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
}

impl WhichState {
    /// Reads the cell, if its file is given.
    ///
    /// # Errors
    /// [`CliError::Configuration`], if the cell is invalid.
    pub(super) fn read_cell(&self) -> Result<Option<Cell>, CliError> {
        self.cell.as_deref().map(Cell::read).transpose().map_err(CliError::from_configuration)
    }

    /// Returns the folder of the results and the drift options.
    pub(super) fn find(&self) -> Result<(PathBuf, DriftOptions), CliError> {
        let service = self.read_cell()?.map_or_else(ServiceSection::default, |cell| cell.service);
        if let Some(folder) = &self.state {
            check_is_folder(folder)?;
        }
        Ok((self.state.clone().unwrap_or(service.state_directory), service.drift))
    }
}

/// Checks that a folder of results that a command names is there and can be read. The folder of a
/// cell is not there before its first result.
///
/// # Errors
/// Names the folder.
pub(super) fn check_is_folder(folder: &Path) -> Result<(), CliError> {
    let Err(cause) = std::fs::read_dir(folder) else { return Ok(()) };
    let remedy = match cause.kind() {
        std::io::ErrorKind::PermissionDenied => "run the command as the service's user",
        _ => "name the folder of the results with --state",
    };
    let why = format!("{cause}; {remedy}");
    Err(CliError::in_file(folder, why))
}
