//! Drives that are taken for each other: the model fits far better with their signals exchanged.

use super::reasons::Reason;
use super::verdict::UNEXPLAINED;
use crate::identification::given::{Context, IdentificationError};
use crate::identification::observation::{
    filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};

/// What the exchange leaves at most of the squares that are left as stated, to speak for it.
const LEAVES: f64 = 0.25;

/// The motor that fits best in the place of the one whose joint leaves most of its torque, where that is much. `errors` are
/// the relative errors of all joints; of rows that no filter has passed, noise is most of what is left.
pub(super) fn exchanged(context: &Context<'_>, errors: &[f64]) -> Option<Reason> {
    let joints = 0..errors.len();
    let worst = joints.clone().max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let is_asked = |worst: &usize| errors[*worst] > UNEXPLAINED && !context.decimation.is_none();
    let worst = worst.filter(is_asked)?;
    let mut best = (LEAVES * errors.iter().map(|error| error * error).sum::<f64>(), None);
    for other in joints.filter(|&other| other != worst) {
        let motors = [worst.min(other), worst.max(other)];
        // Where they have no solution, they do not fit better.
        let Ok(left) = left_with(context, motors) else { continue };
        if left < best.0 {
            best = (left, Some(Reason::Exchanged { motors: motors.map(|motor| motor + 1) }));
        }
    }
    best.1
}

/// The squares of the relative errors of all joints with two motors exchanged.
fn left_with(context: &Context<'_>, motors: [usize; 2]) -> Result<f64, IdentificationError> {
    let transmission = context.robot.transmission();
    let experiment = context.experiment.with_exchanged_motors(transmission, motors);
    let context = context.with_experiment(&experiment);
    let motion = filtered_motion(&experiment, &context.options.position_filter)?;
    let matrix = fitted_matrix(&context, &motion)?;
    let equation = torque_equation(&context, matrix, filtered_torque(&context)?, &motion)?;
    let ordinary = equation.ordinary().map_err(IdentificationError::Regression)?;
    let levels = equation.noise_levels(&ordinary.residuals);
    let solution = equation.weighted(&levels).map_err(IdentificationError::Regression)?;
    let errors = equation.residual_statistics(&solution.residuals).relative_error_per_joint;
    Ok(errors.iter().map(|error| error * error).sum())
}
