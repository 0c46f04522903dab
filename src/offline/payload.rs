//! The load that an arm carries along a recording, by a stored result of the arm without it.

use std::ops::Range;

use didim_core::identification::{Declared, Payload, PayloadError, payload};
use didim_formats::Measurement;

use super::identify::{IdentifyError, joined};
use super::stored::StoredModel;
use crate::cell::Cell;

/// Why no load is found; the inner errors carry the remedy.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The recordings are no experiment of this robot.
    #[error(transparent)]
    Measurement(#[from] IdentifyError),
    /// The result does not tell the arm, or the recording not the load.
    #[error(transparent)]
    Payload(#[from] PayloadError),
}

impl StoredModel {
    /// The load on the last link along measurements, of which the samples in each range count.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn payload(
        &self,
        cell: &Cell,
        measurements: &[(&Measurement, Range<usize>)],
        declared: Declared,
    ) -> Result<Payload, LoadError> {
        let experiment = joined(cell, measurements).map_err(IdentifyError::from)?;
        let named = self.named();
        let arm = self.known(&named);
        Ok(payload(&cell.robot, &cell.base, &experiment, &cell.options, arm, declared)?)
    }
}
