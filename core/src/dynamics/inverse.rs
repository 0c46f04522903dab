//! The inverse dynamic model: the torques that a motion takes.

use super::inertia::Wrench;
use super::{Model, Workspace};
use crate::dispatch::vectorised;
use crate::scalar::Scalar;

impl Model {
    /// Joint torques τ = M(φ, q) q̈ + h(φ, q, q̇) \[N·m or N\] by the recursive Newton–Euler
    /// algorithm, linear in the standard parameters φ, friction and offsets included.
    ///
    /// # Panics
    /// When a slice is not of the model's size: p parameters, n entries for each of the others.
    pub fn inverse_dynamics<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        ddq: &[T],
        tau: &mut [T],
    ) {
        self.check_joints(q);
        self.check_joints(ddq);
        vectorised(
            #[inline(always)]
            || {
                self.newton_euler(ws, parameters, q, dq, Some(ddq), tau);
                let drives = &self.drives;
                drives.for_each_inertia(ddq, |row, column, c| tau[row] += parameters[column] * c);
            },
        );
    }

    /// Joint torques at zero acceleration, h(φ, q, q̇) \[N·m or N\]: centrifugal and Coriolis
    /// torques, gravity, friction and offsets.
    ///
    /// # Panics
    /// As [`inverse_dynamics`](Self::inverse_dynamics).
    pub fn bias<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        tau: &mut [T],
    ) {
        self.check_joints(q);
        vectorised(
            #[inline(always)]
            || self.newton_euler(ws, parameters, q, dq, None, tau),
        );
    }

    /// Friction torques and offsets alone \[N·m or N\], as the inverse dynamic model counts them:
    /// positive against a positive velocity.
    ///
    /// # Panics
    /// As [`inverse_dynamics`](Self::inverse_dynamics).
    #[inline(always)]
    pub fn friction<T: Scalar>(&self, parameters: &[T], dq: &[T], tau: &mut [T]) {
        self.check_parameters(parameters);
        self.check_joints(dq);
        self.check_joints(tau);
        tau.fill(T::zero());
        self.drives.for_each_friction(dq, |row, column, c| tau[row] += parameters[column] * c);
    }

    /// Links, friction and offsets.
    #[inline(always)]
    fn newton_euler<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        ddq: Option<&[T]>,
        tau: &mut [T],
    ) {
        self.friction(parameters, dq, tau);
        self.place(ws, q);
        let links = self.heavy_links(parameters);
        self.propagate(ws, links, dq, ddq);
        // Inward: what link j takes, and all that hangs on it.
        let mut carried = Wrench::zero();
        for (j, joint) in self.chain[..links].iter().enumerate().rev() {
            let total = self.link(parameters, j).wrench(&ws.motions[j]).join(carried);
            tau[j] += total.along(joint.kind);
            carried = total.to_previous(&ws.poses[j]);
        }
    }
}
