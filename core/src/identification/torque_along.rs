//! The torque that a model has along a motion.

use super::given::{Experiment, IdentificationError, Options};
use super::observation::{filtered_motion, filtered_torque, fitted_matrix, torque_equation};
use super::payload::KnownArm;
use crate::dynamics::BaseParameters;
use crate::robot::Robot;

/// The torque of a model along the motion of a record, behind the same filters.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueAlong {
    /// Time of each row since the first sample \[s\].
    pub time_s: Vec<f64>,
    /// Torque of each joint \[N·m or N\].
    pub torque: Vec<Vec<f64>>,
    /// Its standard deviation by the covariance of the parameters; none where that is not known.
    pub standard_deviation: Option<Vec<Vec<f64>>>,
}

/// The torque that a result has along the motion of an experiment, whose torques do not count.
///
/// # Errors
/// [`IdentificationError::UnknownParameter`], and what makes robot, experiment and options no identification.
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
        let spread = &x * model.ordered(&context, &covariance);
        let variance = spread.component_mul(&x).column_sum();
        equation.per_joint(&variance.map(|variance| variance.max(0.0).sqrt()))
    });
    let torque = equation.measured().into_owned() - equation.residuals(&parameters);
    Ok(TorqueAlong {
        time_s: context.time_s(),
        torque: equation.per_joint(&torque),
        standard_deviation: deviations,
    })
}
