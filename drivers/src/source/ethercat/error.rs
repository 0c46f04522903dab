//! What can go wrong with EtherCAT, and what to do about it.

use std::path::PathBuf;

use super::Seen;
use crate::ethercat::CaptureError;

/// Why process data cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EthercatError {
    /// The capture cannot be read.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The layout is of another kind of bus.
    #[error(
        "{}: this is EtherCAT, and the layout is not; name an `eni` file, or a `startup`, and `slaves` under \
         [bus.layout] of the cell",
        place
    )]
    NoPlan {
        /// The capture, or the interface.
        place: String,
    },
    /// The capture is whole and has nothing of the layout.
    #[error("{}: no cyclic process data in this capture: {seen}", path.display())]
    NoProcessData {
        /// The capture.
        path: PathBuf,
        /// What it has.
        seen: Seen,
    },
}

impl EthercatError {
    /// Whether the source goes on by itself.
    pub fn is_recoverable(&self) -> bool {
        false
    }
}
