//! The option for the frame of loads.

use clap::Args;
use didim::cell::{Cell, LoadFrame};
use didim_identification::identification::Finding;

use crate::CliError;

/// Frame in which a load is given and printed.
#[derive(Debug, Args)]
pub(super) struct FrameOfLoads {
    /// The link of the URDF in whose frame a load is given and printed: the last link, or one that
    /// is fixed to it, such as tool0. Without it `frame` in `[payload]` of the cell
    #[arg(long, value_name = "LINK")]
    frame: Option<String>,
}

impl FrameOfLoads {
    /// Returns the frame on the last link of a cell's robot.
    pub(super) fn of_cell(&self, cell: &Cell) -> Result<LoadFrame, CliError> {
        let frame = cell.load_frame(self.frame.as_deref());
        frame.map_err(|error| CliError::Usage(format!("--frame: {error}")))
    }

    /// Returns true if the command line has the option.
    pub(super) fn is_given(&self) -> bool {
        self.frame.is_some()
    }
}

/// Formats findings as notes, one a line.
pub(super) fn note_lines(findings: &[Finding]) -> String {
    findings.iter().map(|finding| format!("note: {}\n", finding.message)).collect()
}
