//! Inverse dynamic model: the torques for a motion.

use super::inertia::Wrench;
use super::model::Model;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::sample::FEW_JOINTS;

impl Model {
    /// Computes the joint torques τ = M(φ, q) q̈ + h(φ, q, q̇) \[N·m or N\] by the recursive
    /// Newton–Euler algorithm. They are linear in the standard parameters φ, including friction and
    /// offsets. The known torques of the robot's file are subtracted.
    ///
    /// # Panics
    /// If a slice does not have the model's size: p parameters, n entries for each of the others.
    pub fn inverse_dynamics<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        ddq: &[T],
        tau: &mut [T],
    ) {
        self.check_joints(ddq);
        self.newton_euler(ws, parameters, q, dq, Some(ddq), tau);
    }

    /// Computes the joint torques at zero acceleration, h(φ, q, q̇) \[N·m or N\]: centrifugal and
    /// Coriolis torques, gravity, friction and offsets.
    ///
    /// # Panics
    /// The same as [`inverse_dynamics`](Self::inverse_dynamics).
    pub fn bias<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        tau: &mut [T],
    ) {
        self.newton_euler(ws, parameters, q, dq, None, tau);
    }

    /// Computes friction torques and offsets alone \[N·m or N\], with the sign of the inverse
    /// dynamic model: positive against a positive velocity. They depend on the positions if they
    /// grow with the load.
    ///
    /// # Panics
    /// The same as [`inverse_dynamics`](Self::inverse_dynamics).
    pub fn friction<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        tau: &mut [T],
    ) {
        self.assert_parameter_count(parameters);
        self.check_joints(q);
        self.check_joints(dq);
        self.check_joints(tau);
        let mut torques: [T; MAX_JOINTS] = self.friction_torques(ws, parameters, dq);
        if self.feels_loads() {
            self.compute_poses(ws, q);
            self.add_load_friction(ws, parameters, [q, dq], &mut torques);
        }
        tau.copy_from_slice(&torques[..tau.len()]);
    }

    /// Returns the same, with zeros for joints that the arm does not have. It has at most `N`.
    #[inline(always)]
    pub(super) fn friction_torques<T: Scalar, const N: usize>(
        &self,
        ws: &Workspace<T>,
        parameters: &[T],
        dq: &[T],
    ) -> [T; N] {
        let mut torques = [T::zero(); N];
        self.drives.for_each_friction(dq, ws.hysteresis.as_ref(), |row, column, c| {
            torques[row] += parameters[column] * c;
        });
        torques
    }

    /// Adds links, friction and offsets, and drive inertias if there is an acceleration.
    fn newton_euler<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        ddq: Option<&[T]>,
        tau: &mut [T],
    ) {
        self.assert_parameter_count(parameters);
        self.check_joints(q);
        self.check_joints(dq);
        self.check_joints(tau);
        T::vectorised(
            #[inline(always)]
            || {
                if self.has_few_joints() {
                    self.torques_inward::<T, FEW_JOINTS>(ws, parameters, [q, dq], ddq, tau);
                } else {
                    self.torques_inward::<T, MAX_JOINTS>(ws, parameters, [q, dq], ddq, tau);
                }
            },
        );
    }

    /// Does so for an arm with at most `N` joints.
    #[inline(always)]
    fn torques_inward<T: Scalar, const N: usize>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        [q, dq]: [&[T]; 2],
        ddq: Option<&[T]>,
        tau: &mut [T],
    ) {
        let mut torques: [T; N] = self.friction_torques(ws, parameters, dq);
        self.take_off_known(q, &mut torques);
        self.compute_poses_up_to::<T, N>(ws, q);
        self.add_load_friction(ws, parameters, [q, dq], &mut torques);
        let links = self.heavy_links(parameters);
        self.compute_motions(ws, links, dq, ddq);
        // Inward: the wrench of link j and of all links that it supports.
        let mut transferred = Wrench::zero();
        for (j, joint) in self.chain[..links].iter().enumerate().rev() {
            let total = self.link(parameters, j).wrench(&ws.motions[j]).combined(transferred);
            torques[j] += total.generalised_force(joint.kind);
            transferred = total.to_previous(&ws.poses[j]);
        }
        if let Some(ddq) = ddq {
            self.drives.for_each_inertia(ddq, |row, column, c| {
                torques[row] += parameters[column] * c;
            });
        }
        for (tau, torque) in tau.iter_mut().zip(torques) {
            *tau = torque;
        }
    }
}
