//! What the model leaves of other signals than those that were logged, and which parameters they give.

use nalgebra::DVector;

use crate::identification::given::{Context, Experiment, IdentificationError, Method};
use crate::identification::observation::{
    Motion, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};

/// Samples that are looked at: what is the matter with signals is so from the first on.
pub(super) const LOOKED_AT: usize = 1 << 14;

/// The least-squares solution of other signals.
pub(super) struct Refitted {
    /// θ.
    pub(super) parameters: DVector<f64>,
    /// The squares of the relative errors of all joints.
    pub(super) left: f64,
}

impl Refitted {
    /// Of other signals of the arm of a context.
    pub(super) fn new(
        context: &Context<'_>,
        experiment: &Experiment,
    ) -> Result<Self, IdentificationError> {
        let (context, motion) = of_signals(context, experiment)?;
        let matrix = fitted_matrix(&context, &motion)?;
        let equation = torque_equation(&context, matrix, filtered_torque(&context)?, &motion)?;
        let ordinary = equation.ordinary().map_err(IdentificationError::Regression)?;
        let levels = equation.noise_levels(&ordinary.residuals);
        let solution = equation.weighted(&levels).map_err(IdentificationError::Regression)?;
        let errors = equation.residual_statistics(&solution.residuals).relative_error_per_joint;
        let left = errors.iter().map(|error| error * error).sum();
        Ok(Self { parameters: solution.parameters, left })
    }
}

/// What is asked of other signals of the arm of a context, and its motion by them.
fn of_signals<'a>(
    context: &Context<'a>,
    experiment: &'a Experiment,
) -> Result<(Context<'a>, Motion), IdentificationError> {
    let Context { robot, base, options, model, .. } = context;
    let mut context = Context::new(robot, base, experiment, options, Method::IdimLs)?;
    // Where friction grows with the load, at the same loads.
    context.model = model.clone();
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    Ok((context, motion))
}
