//! Model residual with other signals than the logged ones, and the parameters from these signals.

use nalgebra::DVector;

use crate::identification::observation::{
    Motion, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::problem::{Context, Experiment, IdentificationError, Method};

/// Number of samples used. Signal faults are present from the first sample on.
pub(super) const INSPECTED: usize = 1 << 14;

/// Least-squares solution with other signals.
pub(super) struct Refit {
    /// θ.
    pub(super) parameters: DVector<f64>,
    /// Sum of the squared relative errors of all joints.
    pub(super) remaining: f64,
}

impl Refit {
    /// Solves with other signals for the arm of a context.
    pub(super) fn new(
        context: &Context<'_>,
        experiment: &Experiment,
    ) -> Result<Self, IdentificationError> {
        let (context, motion) = of_signals(context, experiment)?;
        let matrix = fitted_matrix(&context, &motion)?;
        let equation = torque_equation(&context, matrix, filtered_torque(&context)?, &motion)?;
        let ordinary = equation.solve_ordinary().map_err(IdentificationError::Regression)?;
        let levels = equation.noise_levels(&ordinary.residuals);
        let solution = equation.solve_weighted(&levels).map_err(IdentificationError::Regression)?;
        let errors = equation.residual_statistics(&solution.residuals).relative_error_per_joint;
        // Joints without a recorded torque have no error.
        let left = errors.iter().filter(|error| !error.is_nan()).map(|error| error * error).sum();
        Ok(Self { parameters: solution.parameters, remaining: left })
    }
}

/// Returns the context for other signals of the same arm, and the motion from these signals.
fn of_signals<'a>(
    context: &Context<'a>,
    experiment: &'a Experiment,
) -> Result<(Context<'a>, Motion), IdentificationError> {
    let Context { robot, base, options, model, .. } = context;
    let mut context = Context::new(robot, base, experiment, options, Method::IdimLs)?;
    // Load-dependent friction keeps the same loads.
    context.model = model.clone();
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    Ok((context, motion))
}
