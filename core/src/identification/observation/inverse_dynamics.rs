//! The torques of the model with an estimate.

use nalgebra::DVector;

use crate::MAX_JOINTS;
use crate::dynamics::{Model, Workspace};
use crate::identification::given::Context;
use crate::numeric::{Lanes, Scalar};
use crate::signal::Group;

/// The inverse dynamic model with the parameters of an estimate, by lanes of samples.
pub(crate) struct InverseDynamics {
    standard: Vec<Group>,
    workspace: Workspace<Group>,
}

impl InverseDynamics {
    pub(crate) fn of_the_estimate(context: &Context<'_>, parameters: &DVector<f64>) -> Self {
        let standard = context.selection.standard(parameters);
        let standard = standard.into_iter().map(Lanes::constant).collect();
        Self { standard, workspace: Workspace::new() }
    }

    /// Torque of every joint \[N·m or N\] at q, q̇ and q̈, zeros beyond, by the model of the estimate or one of
    /// another geometry.
    pub(crate) fn torque(
        &mut self,
        model: &Model,
        [q, dq, ddq]: [&[Group]; 3],
    ) -> [Group; MAX_JOINTS] {
        let mut torque = [Lanes::zero(); MAX_JOINTS];
        let of_joints = &mut torque[..q.len()];
        model.inverse_dynamics(&mut self.workspace, &self.standard, q, dq, ddq, of_joints);
        torque
    }
}
