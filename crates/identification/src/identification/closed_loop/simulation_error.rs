//! Errors of a simulated loop (paper, table 3): relative errors over the rows of each joint,
//! filtered and decimated as those of the equation.

use nalgebra::DVector;

use crate::identification::observation::Motion;
use crate::identification::problem::{Context, IdentificationError};

/// Returns ‖q − q_s‖ / ‖q‖ of each joint for a simulated motion.
pub(super) fn position_errors(
    context: &Context<'_>,
    motion: &Motion,
) -> Result<Vec<f64>, IdentificationError> {
    let measured = context.rows_of(context.experiment.position_rad(), "position")?;
    let simulated = context.rows_of(&motion.position, "position")?;
    Ok(relative_errors(context.robot.joints(), &measured, &simulated))
}

/// Returns ‖y − y_s‖ / ‖y‖ over the rows of each joint.
pub(super) fn relative_errors(
    joints: usize,
    measured: &DVector<f64>,
    simulated: &DVector<f64>,
) -> Vec<f64> {
    let rows = measured.len() / joints;
    let pairs = (0..joints).map(|joint| {
        let range = joint * rows..(joint + 1) * rows;
        (measured.rows_range(range.clone()), simulated.rows_range(range))
    });
    pairs.map(|(y, simulated)| (y - simulated).norm() / y.norm()).collect()
}
