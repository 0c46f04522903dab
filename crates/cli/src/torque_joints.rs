//! `--joints`: the joints whose torque is used.

use std::path::Path;

use clap::Args;
use didim::cell::{Cell, JointReference};

use super::CliError;

/// Joints whose torque is used.
#[derive(Debug, Args)]
pub(super) struct TorqueJoints {
    /// Use the torques of these joints alone: their numbers from 1 or their names, with commas
    /// between them; those of the cell when left out
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    joints: Vec<JointReference>,
}

impl TorqueJoints {
    /// Reads a cell, with the torques of the chosen joints alone.
    ///
    /// # Errors
    /// [`CliError::Configuration`], and [`CliError::Usage`] for joints that the arm does not have.
    pub(super) fn read_cell(&self, file: &Path) -> Result<Cell, CliError> {
        let cell = Cell::read(file).map_err(CliError::from_configuration)?;
        if self.joints.is_empty() {
            return Ok(cell);
        }
        let chosen = cell.with_torque_joints(&self.joints);
        chosen.map_err(|error| CliError::Usage(format!("--joints: {error}")))
    }
}
