//! Known part of the torque, which depends on no identified parameter. It comes from parameters
//! fixed at their nominal values, and from springs and counterbalances.

use nalgebra::DVector;

use super::group::MotionGroup;
use super::inverse_dynamics::InverseDynamics;
use super::motion::Motion;
use crate::identification::problem::{Context, IdentificationError};
use crate::regression::{ObservationMatrix, Observations};
use crate::signal::{Group, ParallelDecimation};

/// Returns the equation of these torques and their observation matrix along a motion. Both are
/// filtered and decimated. The known part of the torques is subtracted. Joints without a recorded
/// torque have no equation.
///
/// # Errors
/// Those of [`Observations::new`], with the parameters' names, and
/// [`IdentificationError::Regressor`].
pub(crate) fn torque_equation(
    context: &Context<'_>,
    matrix: ObservationMatrix,
    mut torque: DVector<f64>,
    motion: &Motion,
) -> Result<Observations, IdentificationError> {
    let mut known_torque = known_rows(context, motion)?;
    if let Some(known_sum) = &known_torque {
        torque -= known_sum;
    }
    // A joint without a recorded torque has no equation.
    for joint in context.model.missing_torques() {
        let rows = matrix.rows_per_joint();
        for column in known_torque.iter_mut().chain([&mut torque]) {
            column.rows_mut(joint.position() * rows, rows).fill(0.0);
        }
    }
    let observations = Observations::from_dense(matrix, torque);
    let observations = observations.map_err(|error| context.selection.regression_failure(error))?;
    Ok(observations.with_known(known_torque))
}

/// Returns the rows of the known torque along a motion; `None` if there is no known torque.
pub(crate) fn known_rows(
    context: &Context<'_>,
    motion: &Motion,
) -> Result<Option<DVector<f64>>, IdentificationError> {
    let Some(mut read) = known_along(context, motion) else { return Ok(None) };
    let rows = context
        .decimate_signals(context.robot.joints(), &mut read)
        .map_err(IdentificationError::of_regressor)?;
    Ok(Some(DVector::from_column_slice(rows.as_slice())))
}

/// Returns the known torque at the states of a motion, the rows of each joint together; `None` if
/// there is no known torque.
pub(crate) fn known_at(
    context: &Context<'_>,
    states: &Motion,
) -> Result<Option<DVector<f64>>, IdentificationError> {
    let Some(mut read) = known_along(context, states) else { return Ok(None) };
    let (samples, joints) = states.position.shape();
    let none = ParallelDecimation::identity();
    let rows = none
        .decimate_groups(samples, joints, 0..samples, &mut read)
        .map_err(IdentificationError::of_regressor)?;
    Ok(Some(DVector::from_column_slice(rows.as_slice())))
}

/// Returns the torque of the model with every identified parameter at 0, by lanes of samples.
fn known_along<'a>(
    context: &'a Context<'_>,
    motion: &'a Motion,
) -> Option<impl FnMut(usize, &mut [Group]) + use<'a>> {
    let (model, selection) = (&context.model, &context.selection);
    if selection.fixed().is_empty() && context.robot.known_torques().iter().all(Option::is_none) {
        return None;
    }
    let nothing = DVector::zeros(selection.names().len());
    let mut dynamics = InverseDynamics::of_the_estimate(context, &nothing);
    let mut group = MotionGroup::of_joints(model.joints());
    Some(move |first: usize, torque: &mut [Group]| {
        let known_nm = dynamics.torque(model, group.read(motion, first));
        torque.copy_from_slice(&known_nm[..torque.len()]);
    })
}
