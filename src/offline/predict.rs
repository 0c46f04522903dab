//! A stored result on a recording that it was not identified from.

use std::ops::Range;

use didim_core::identification::{KnownArm, Prediction, predict};

use super::identify::{IdentifyError, joined};
use super::stored::StoredModel;
use crate::cell::Cell;
use didim_formats::Measurement;

impl StoredModel {
    /// Predicts the torques of a measurement, of which the samples in `counted` count.
    ///
    /// # Errors
    /// See [`IdentifyError`].
    pub fn predict(
        &self,
        cell: &Cell,
        measurements: &[(&Measurement, Range<usize>)],
    ) -> Result<Prediction, IdentifyError> {
        let experiment = joined(cell, measurements)?;
        let named = self.named();
        let KnownArm { model, .. } = self.known(&named);
        Ok(predict(&cell.robot, &cell.base, &experiment, &cell.options, model)?)
    }
}
