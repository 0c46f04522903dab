//! How well parameters predict the torques of a record that they need not have been found from.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::given::{Context, Experiment, IdentificationError, Method, Options};
use super::observation::{filtered_motion, filtered_torque, fitted_matrix};
use crate::dynamics::BaseParameters;
use crate::robot::Robot;

/// ‖y − Xθ‖ / ‖y‖ of some rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictionError {
    /// Over all joints.
    pub relative_error: f64,
    /// Of every joint.
    pub relative_error_per_joint: Vec<f64>,
    /// Root mean square of y − Xθ of every joint \[N·m or N\].
    pub rms_error_per_joint_nm: Vec<f64>,
}

/// Predicts the torques of an experiment by the inverse dynamic model with these base parameters, every
/// other 0, along the filtered measured motion, both sides behind the parallel filter. Nothing is fitted.
///
/// # Errors
/// [`IdentificationError::UnknownParameter`], and what makes robot, experiment and options no
/// identification.
pub fn predict(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    parameters: &[(&str, f64)],
) -> Result<PredictionError, IdentificationError> {
    let options = Options { parameters: None, required_parameters: None, ..options.clone() };
    let context = Context::new(robot, base, experiment, &options, Method::IdimLs)?;
    let prediction = Prediction::new(&context)?;
    let mut errors = Errors::new(robot.joints());
    errors.add(&prediction, &(0..experiment.samples()), parameters)?;
    Ok(errors.relative())
}

/// The rows of the inverse dynamic model with all base parameters.
pub(super) struct Prediction<'a> {
    context: &'a Context<'a>,
    matrix: DMatrix<f64>,
    torque: DVector<f64>,
}

impl<'a> Prediction<'a> {
    pub(super) fn new(context: &'a Context<'a>) -> Result<Self, IdentificationError> {
        let motion = filtered_motion(context.experiment, &context.options.position_filter)?;
        let matrix = fitted_matrix(context, &motion)?;
        Ok(Self { context, matrix, torque: filtered_torque(context)? })
    }
}

/// ‖y − Xθ‖² and ‖y‖² of every joint, and the rows of each.
pub(super) struct Errors {
    sums: Vec<[f64; 2]>,
    rows: usize,
}

impl Errors {
    pub(super) fn new(joints: usize) -> Self {
        Self { sums: vec![[0.0; 2]; joints], rows: 0 }
    }

    /// Adds the rows of these samples.
    pub(super) fn add(
        &mut self,
        prediction: &Prediction<'_>,
        samples: &Range<usize>,
        parameters: &[(&str, f64)],
    ) -> Result<(), IdentificationError> {
        let Prediction { context, matrix, torque } = prediction;
        let mut values = DVector::zeros(matrix.ncols());
        for (name, value) in parameters {
            let index = context.base.find(name).ok_or_else(|| {
                let known = context.base.names().to_vec();
                IdentificationError::UnknownParameter { name: (*name).to_owned(), known }
            })?;
            values[index] = *value;
        }
        let left = torque - matrix * values;
        let rows = context.samples.len();
        let kept: Vec<usize> = (context.samples.iter().enumerate())
            .filter(|(_, sample)| samples.contains(sample))
            .map(|(row, _)| row)
            .collect();
        for (joint, [errors, torques]) in self.sums.iter_mut().enumerate() {
            for row in kept.iter().map(|row| joint * rows + row) {
                *errors += left[row].powi(2);
                *torques += torque[row].powi(2);
            }
        }
        self.rows += kept.len();
        Ok(())
    }

    pub(super) fn relative(&self) -> PredictionError {
        let all = self.sums.iter().fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        let relative = |[errors, torques]: &[f64; 2]| (errors / torques).sqrt();
        let rms = |[errors, _]: &[f64; 2]| (errors / self.rows as f64).sqrt();
        PredictionError {
            relative_error: relative(&all),
            relative_error_per_joint: self.sums.iter().map(relative).collect(),
            rms_error_per_joint_nm: self.sums.iter().map(rms).collect(),
        }
    }
}
