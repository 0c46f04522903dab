//! Prediction error of parameters on a record, which need not be the one that they were identified
//! from.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::judgement::{ModelUncertainty, PredictedError, ResidualQuantiles};
use super::observation::{BaseColumns, filtered_motion, filtered_torque, torque_equation};
use super::problem::{Context, Experiment, IdentificationError, Method, Options, Selection};
use crate::regression::Observations;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Relative error ‖y − Xθ‖ / ‖y‖ of some rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictionError {
    /// Relative error over all joints.
    pub relative_error: f64,
    /// Relative error of each joint.
    pub relative_error_per_joint: Vec<f64>,
    /// Root mean square of y − Xθ of each joint \[N·m or N\].
    pub rms_error_per_joint_nm: Vec<f64>,
}

/// Arm parameters from a result, with their uncertainty.
#[derive(Clone, Copy, Debug)]
pub struct KnownModel<'a> {
    /// Identified base parameters by name, in SI units.
    pub parameters: &'a [(&'a str, f64)],
    /// Further parameters fixed at their nominal values. All others are 0.
    pub fixed_parameters: &'a [(&'a str, f64)],
    /// Model uncertainty, if the result contains it.
    pub uncertainty: Option<&'a ModelUncertainty>,
}

impl KnownModel<'_> {
    /// Returns options that select these parameters for the equation.
    pub(super) fn options(&self, options: &Options) -> Options {
        let names = self.parameters.iter().map(|(name, _)| (*name).to_owned()).collect();
        let parameters = Some(names);
        Options { parameters, keep_nominal: None, required_parameters: None, ..options.clone() }
    }

    /// Returns the context of the equation, and the parameters in its order, with the
    /// [`options`](Self::options).
    ///
    /// # Errors
    /// [`IdentificationError::UnknownParameter`], and the errors of a robot, experiment and options
    /// that form no identification.
    pub(super) fn context<'c>(
        &self,
        robot: &'c Robot,
        base: &'c BaseParameters,
        experiment: &'c Experiment,
        options: &'c Options,
    ) -> Result<(Context<'c>, DVector<f64>), IdentificationError> {
        let mut context = Context::new(robot, base, experiment, options, Method::IdimLs)?;
        context.selection.keep_values(base, self.fixed_parameters.iter().copied())?;
        let parameters = self.values(&context.selection);
        context.set_loads(&parameters);
        Ok((context, parameters))
    }

    /// Returns the values of the parameters in the order of a selection of all of them.
    pub(crate) fn values(&self, selection: &Selection) -> DVector<f64> {
        let named = |name: &String| self.parameters.iter().find(|(own, _)| own == name);
        let values = selection.names().iter().filter_map(named).map(|(_, value)| *value);
        DVector::from_iterator(self.parameters.len(), values)
    }

    /// Reorders a covariance of the parameters (b × b) to the order of a selection of all of them.
    pub(crate) fn reorder_covariance(
        &self,
        selection: &Selection,
        covariance: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let place = |name: &String| self.parameters.iter().position(|(own, _)| own == name);
        let order: Vec<usize> = selection.names().iter().filter_map(place).collect();
        covariance.select_rows(&order).select_columns(&order)
    }
}

impl PredictionError {
    /// Computes the error from these residuals (r) of an equation.
    pub(super) fn from_residuals(observations: &Observations, residuals: &DVector<f64>) -> Self {
        let statistics = observations.residual_statistics(residuals);
        Self {
            relative_error: statistics.relative_error,
            relative_error_per_joint: statistics.relative_error_per_joint,
            rms_error_per_joint_nm: statistics.rms_per_joint,
        }
    }
}

/// Predicted torques of a record, compared with the measured ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Difference between the measured and the predicted torques.
    #[serde(flatten)]
    pub error: PredictionError,
    /// Quantiles of the difference at the sample rate, for each joint.
    pub quantiles_per_joint: Vec<ResidualQuantiles>,
    /// Error that the result predicts along this motion. `None` if the result does not contain it,
    /// or belongs to another robot or other parameters.
    #[serde(rename = "foretold")]
    pub expected_error: Option<PredictedError>,
    /// Time of each row since the first sample \[s\].
    #[serde(skip)]
    pub time_s: Vec<f64>,
    /// Filtered measured torque of each joint \[N·m or N\].
    #[serde(skip)]
    pub measured: Vec<Vec<f64>>,
    /// Predicted torque of each joint, filtered in the same way \[N·m or N\].
    #[serde(skip)]
    pub predicted: Vec<Vec<f64>>,
}

/// Predicts the torques of an experiment by the inverse dynamic model along the filtered measured
/// motion. Both sides pass the parallel filter. Nothing is fitted.
///
/// # Errors
/// [`IdentificationError::UnknownParameter`], and the errors of a robot, experiment and options
/// that form no identification.
pub fn predict(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    model: KnownModel<'_>,
) -> Result<Prediction, IdentificationError> {
    let options = model.options(options);
    let (context, parameters) = model.context(robot, base, experiment, &options)?;
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    let BaseColumns { selected, auxiliary } = BaseColumns::new(&context, &motion)?;
    let observations = torque_equation(&context, selected, filtered_torque(&context)?, &motion)?;
    let residuals = observations.residuals(&parameters);
    let expected_error = match model.uncertainty {
        None => None,
        Some(uncertainty) => {
            uncertainty.expected_error(&context, &motion, &auxiliary, &observations, &parameters)?
        }
    };
    let measured = observations.measured_values();
    Ok(Prediction {
        error: PredictionError::from_residuals(&observations, &residuals),
        quantiles_per_joint: ResidualQuantiles::per_joint(
            &context,
            &motion,
            core::slice::from_ref(&parameters),
            &|_| 0,
        )?,
        expected_error,
        time_s: context.time_s(),
        measured: observations.per_joint(&measured),
        predicted: observations.per_joint(&(&*measured - residuals)),
    })
}
