//! Drives that are taken for each other: the model fits far better with their signals exchanged.

use super::reasons::Reason;
use super::verdict::UNEXPLAINED;
use crate::identification::given::{Context, Experiment, IdentificationError, Method};
use crate::identification::observation::{
    filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};

/// What the exchange leaves at most of the squares that are left as stated, to speak for it.
const LEAVES: f64 = 0.25;

/// Samples that are looked at: what is exchanged is so from the first on.
const LOOKED_AT: usize = 1 << 14;

/// The motor that fits best in the place of the one whose joint leaves most of its torque, where that is much. `errors` are
/// the relative errors of all joints; of rows that no filter has passed, noise is most of what is left.
pub(super) fn exchanged(context: &Context<'_>, errors: &[f64]) -> Option<Reason> {
    let joints = 0..errors.len();
    let worst = joints.clone().max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let is_asked = |worst: &usize| errors[*worst] > UNEXPLAINED && !context.decimation.is_none();
    let worst = worst.filter(is_asked)?;
    let (stated, transmission) =
        (context.experiment.beginning(LOOKED_AT), context.robot.transmission());
    let mut best = (LEAVES * left_of(context, &stated).ok()?, None);
    for other in joints.filter(|&other| other != worst) {
        let motors = [worst.min(other), worst.max(other)];
        // Where they have no solution, they do not fit better.
        let exchanged = stated.with_exchanged_motors(transmission, motors);
        let Ok(left) = left_of(context, &exchanged) else { continue };
        if left < best.0 {
            best = (left, Some(Reason::Exchanged { motors: motors.map(|motor| motor + 1) }));
        }
    }
    best.1
}

/// The squares of the relative errors of all joints in other signals.
fn left_of(context: &Context<'_>, experiment: &Experiment) -> Result<f64, IdentificationError> {
    let Context { robot, base, options, model, .. } = context;
    let mut context = Context::new(robot, base, experiment, options, Method::IdimLs)?;
    // Where friction grows with the load, at the same loads.
    context.model = model.clone();
    let motion = filtered_motion(experiment, &options.position_filter)?;
    let matrix = fitted_matrix(&context, &motion)?;
    let equation = torque_equation(&context, matrix, filtered_torque(&context)?, &motion)?;
    let ordinary = equation.ordinary().map_err(IdentificationError::Regression)?;
    let levels = equation.noise_levels(&ordinary.residuals);
    let solution = equation.weighted(&levels).map_err(IdentificationError::Regression)?;
    let errors = equation.residual_statistics(&solution.residuals).relative_error_per_joint;
    Ok(errors.iter().map(|error| error * error).sum())
}
