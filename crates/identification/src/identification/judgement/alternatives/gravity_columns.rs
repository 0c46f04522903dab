//! Observation matrix for any gravity.

use didim_dynamics::robot::Robot;
use nalgebra::DVector;

use crate::identification::observation::{
    Motion, fitted_gravity_matrices, gravity_matrices_at, matrix_at,
};
use crate::identification::problem::Context;
use crate::regression::ObservationMatrix;
use didim_dynamics::dynamics::Model;

/// Observation matrix as a linear function of gravity.
pub(super) struct GravityColumns {
    /// Matrix with the gravity of `origin_m_s2`.
    own: ObservationMatrix,
    origin_m_s2: [f64; 3],
    /// Addition by 1 m/s² along each axis of the base.
    along: [ObservationMatrix; 3],
}

impl GravityColumns {
    /// Creates the columns of fitted rows from their matrix. `None` if they cannot be filtered.
    pub(super) fn fitted(
        context: &Context<'_>,
        motion: &Motion,
        own: ObservationMatrix,
    ) -> Option<Self> {
        let along = fitted_gravity_matrices(context, motion).ok()?;
        Some(Self { own, origin_m_s2: context.model.gravity_m_s2(), along })
    }

    /// Creates these regressor columns at the states of a motion. `None` if they are not finite.
    pub(super) fn at(
        (robot, model): (&Robot, &Model),
        columns: &[usize],
        states: &Motion,
    ) -> Option<Self> {
        let own = matrix_at(model, columns, states).ok()?;
        let along = gravity_matrices_at((robot, model), columns, states).ok()?;
        Some(Self { own, origin_m_s2: model.gravity_m_s2(), along })
    }

    /// Returns the matrix with another gravity.
    pub(super) fn matrix(&self, gravity_m_s2: [f64; 3]) -> ObservationMatrix {
        let mut matrix = self.own.clone();
        for (axis, along) in self.along.iter().enumerate() {
            matrix.add_scaled(gravity_m_s2[axis] - self.origin_m_s2[axis], along);
        }
        matrix
    }

    /// Returns what a change of gravity adds to the torques of these parameters.
    pub(super) fn added_torque(
        &self,
        change_m_s2: [f64; 3],
        parameters: &DVector<f64>,
    ) -> DVector<f64> {
        let along = self.along.iter().zip(change_m_s2);
        along.map(|(matrix, change)| matrix.times_parameters(parameters) * change).sum()
    }
}
