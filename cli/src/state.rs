//! Which folder of results is meant.

use std::path::PathBuf;

use clap::Args;

use super::CliError;
use didim::archive::drift::DriftOptions;
use didim::cell::{Cell, ServiceSection};

/// Which folder of results is meant.
#[derive(Debug, Args)]
pub(super) struct WhichState {
    /// The cell file of the service, for the folder of its results and its limits of drift
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// The folder of its results [default: the cell's, or /var/lib/didim]
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
}

impl WhichState {
    /// The cell, where its file is given.
    ///
    /// # Errors
    /// [`CliError::configuration`].
    pub(super) fn cell(&self) -> Result<Option<Cell>, CliError> {
        self.cell.as_deref().map(Cell::read).transpose().map_err(CliError::configuration)
    }

    /// The folder, and what counts as drift.
    pub(super) fn find(&self) -> Result<(PathBuf, DriftOptions), CliError> {
        let service = self.cell()?.map_or_else(ServiceSection::default, |cell| cell.service);
        Ok((self.state.clone().unwrap_or(service.state_directory), service.drift))
    }
}
