//! Prediction of a stored result on a recording that it was not identified from.

use std::ops::Range;

use didim_identification::identification::{KnownArm, Prediction, predict};

use super::identify::{IdentifyError, join_measurements};
use super::stored_model::StoredModel;
use crate::cell::Cell;
use didim_formats::Measurement;

impl StoredModel {
    /// Predicts the torques of a measurement for the samples in `counted`.
    ///
    /// # Errors
    /// See [`IdentifyError`].
    pub fn predict(
        &self,
        cell: &Cell,
        measurements: &[(&Measurement, Range<usize>)],
    ) -> Result<Prediction, IdentifyError> {
        let experiment = join_measurements(cell, measurements)?;
        let named = self.named_parameters();
        let KnownArm { model, .. } = self.known_arm(&named);
        Ok(predict(&cell.robot, &cell.base, &experiment, &cell.options, model)?)
    }
}
