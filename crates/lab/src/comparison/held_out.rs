//! Prediction errors of each method on held-out samples.

use didim_identification::identification::{Method, PredictionError};
use serde::Serialize;

use super::input::ComparisonInput;
use super::trial::Framework;
use didim::analysis::identify::cross_validate_measurement;

/// Prediction errors of one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// The method. It runs after the decimation filter.
    pub method: Method,
    /// Number of consecutive blocks; each is predicted with the estimate from the others.
    pub blocks: usize,
    /// Errors of the predictions of the held-out blocks.
    pub held_out: Option<TorqueErrors>,
    /// Errors of predictions of the same samples with the estimate from all samples.
    pub in_sample: Option<TorqueErrors>,
    /// Reason why there are no errors; `None` if there are errors.
    pub failure: Option<String>,
}

/// Relative torque errors ‖y − Xθ‖ / ‖y‖ along the measured motion, for all blocks together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueErrors {
    /// Error over all joints.
    pub relative_error: f64,
    /// Errors of the joints, one entry per joint.
    pub relative_error_per_joint: Vec<f64>,
}

impl From<PredictionError> for TorqueErrors {
    fn from(of: PredictionError) -> Self {
        let PredictionError { relative_error, relative_error_per_joint, .. } = of;
        Self { relative_error, relative_error_per_joint }
    }
}

impl HeldOut {
    pub(super) fn new(input: ComparisonInput<'_>, method: Method, blocks: usize) -> Self {
        let cell = input.cell_in(Framework::Decimated);
        let (measurement, counted) = (input.measurement, input.counted_samples.clone());
        match cross_validate_measurement(&cell, method, measurement, counted, blocks) {
            Ok(found) => Self {
                method,
                blocks,
                held_out: Some(found.held_out.into()),
                in_sample: Some(found.in_sample.into()),
                failure: None,
            },
            Err(error) => {
                let failure = Some(error.to_string());
                Self { method, blocks, held_out: None, in_sample: None, failure }
            }
        }
    }
}
