//! Torques of the model with an estimate.

use nalgebra::DVector;

use super::group::{MotionGroup, States};
use super::motion::Motion;
use crate::identification::problem::{Context, IdentificationError};
use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar};

/// Inverse dynamic model with the parameters of an estimate, evaluated by lanes of samples.
pub(crate) struct InverseDynamics {
    standard_parameters: Vec<Group>,
    workspace: Workspace<Group>,
}

impl InverseDynamics {
    pub(crate) fn of_the_estimate(context: &Context<'_>, parameters: &DVector<f64>) -> Self {
        let standard = context.selection.to_standard(parameters);
        let standard = standard.into_iter().map(Lanes::constant).collect();
        Self { standard_parameters: standard, workspace: Workspace::new() }
    }

    /// Returns the torque of every joint \[N·m or N\] at these states; entries beyond the number of
    /// joints are 0, and those of joints without a recorded torque. The model is that of the
    /// estimate, or one with another geometry.
    pub(crate) fn torque(
        &mut self,
        model: &Model,
        States { q, dq, ddq, hysteresis }: States<'_>,
    ) -> [Group; MAX_JOINTS] {
        let mut torque = [Lanes::zero(); MAX_JOINTS];
        self.workspace.set_hysteresis(hysteresis.copied());
        let of_joints = &mut torque[..q.len()];
        model.inverse_dynamics(
            &mut self.workspace,
            &self.standard_parameters,
            q,
            dq,
            ddq,
            of_joints,
        );
        for joint in model.missing_torques() {
            torque[*joint] = Lanes::zero();
        }
        torque
    }
}

/// Returns the time derivatives of an estimate's torques along a motion, filtered and decimated,
/// with the rows of each joint together \[N·m/s or N/s\].
///
/// # Errors
/// [`IdentificationError::Regressor`] when they are not finite.
pub(crate) fn torque_rates(
    context: &Context<'_>,
    motion: &Motion,
    parameters: &DVector<f64>,
) -> Result<DVector<f64>, IdentificationError> {
    let joints = context.robot.joints();
    let mut dynamics = InverseDynamics::of_the_estimate(context, parameters);
    let mut group = MotionGroup::of_joints(joints);
    let mut read = |first: usize, torques: &mut [Group]| {
        let torque = dynamics.torque(&context.model, group.read(motion, first));
        torques.copy_from_slice(&torque[..joints]);
    };
    let filtered = context.decimate_with_differences(joints, &mut read);
    let [_, differences] = filtered.map_err(IdentificationError::of_regressor)?;
    let rates = differences * (0.5 * context.experiment.sample_rate_hz());
    Ok(DVector::from_column_slice(rates.as_slice()))
}
