//! Torque of a model along a motion.

use super::observation::{filtered_motion, filtered_torque, fitted_matrix, torque_equation};
use super::payload::KnownArm;
use super::problem::{Experiment, IdentificationError, Options};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Torque of a model along the motion of a record, filtered and decimated like the record's torque.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueAlong {
    /// Time of each row since the first sample \[s\].
    pub time_s: Vec<f64>,
    /// Torque of each joint \[N·m or N\].
    pub torque: Vec<Vec<f64>>,
    /// Standard deviation of the torque, from the covariance of the parameters; `None` if there is
    /// no covariance.
    pub standard_deviation: Option<Vec<Vec<f64>>>,
}

/// Returns the torque of a result along the motion of an experiment. The torques of the experiment
/// are not used.
///
/// # Errors
/// [`IdentificationError::UnknownParameter`], and the errors of a robot, experiment and options
/// that form no identification.
pub fn torque_along(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    arm: KnownArm<'_>,
) -> Result<TorqueAlong, IdentificationError> {
    let KnownArm { model, covariance } = arm;
    let options = model.options(options);
    let (context, parameters) = model.context(robot, base, experiment, &options)?;
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    let matrix = fitted_matrix(&context, &motion)?;
    let equation = torque_equation(&context, matrix, filtered_torque(&context)?, &motion)?;
    let covariance = covariance.and_then(|of| of.matrix(model.parameters.len()));
    let deviations = covariance.map(|covariance| {
        let x = equation.matrix().dense();
        let spread = &x * model.reorder_covariance(&context.selection, &covariance);
        let variance = spread.component_mul(&x).column_sum();
        equation.per_joint(&variance.map(|variance| variance.max(0.0).sqrt()))
    });
    let torque = equation.measured_values().into_owned() - equation.residuals(&parameters);
    Ok(TorqueAlong {
        time_s: context.time_s(),
        torque: equation.per_joint(&torque),
        standard_deviation: deviations,
    })
}
