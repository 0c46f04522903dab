//! The regressor: the inverse dynamic model as a matrix times the standard parameters.

use super::kinematics::Motion;
use super::vector::Vector3;
use super::{Model, Workspace};
use crate::MAX_JOINTS;
use crate::robot::JointKind;
use crate::scalar::Scalar;

impl Model {
    /// The matrix Y(q, q̇, q̈) with τ = Y φ: n × p, row-major, row = joint, columns as
    /// [`parameter_names`](Self::parameter_names).
    ///
    /// By virtual power: a unit velocity of joint i moves the origin of link l with b and turns
    /// the link with c, both in the link's frame, and τ_i is the sum over the links of
    /// c · N_l + b · F_l.
    ///
    /// # Panics
    /// When a slice is not of the model's size: n entries for q, dq and ddq, n × p for `out`.
    pub fn regressor<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        q: &[T],
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        self.check_joints(q);
        self.check_joints(dq);
        self.check_joints(ddq);
        let width = self.parameter_names().len();
        assert_eq!(out.len(), self.joints() * width, "one row per joint, one column per parameter");
        out.fill(T::zero());
        self.place(ws, q);
        self.propagate(ws, dq, Some(ddq));

        for (i, joint) in self.chain.iter().enumerate() {
            let z = Vector3::along_z(T::constant(1.0));
            let (mut turn, mut shift) = match joint.kind {
                JointKind::Revolute => (z, Vector3::zero()),
                JointKind::Prismatic => (Vector3::zero(), z),
            };
            let row = &mut out[i * width..(i + 1) * width];
            for l in i..self.chain.len() {
                if l > i {
                    let pose = &ws.poses[l];
                    shift = pose.to_link(shift + turn.cross(pose.origin));
                    turn = pose.to_link(turn);
                }
                let columns = link_columns(turn, shift, &ws.motions[l]);
                let first = self.first_columns[l];
                row[first..first + columns.len()].copy_from_slice(&columns);
            }
        }
        self.drives.for_each_inertia(ddq, |row, column, c| out[row * width + column] += c);
        self.drives.for_each_friction(dq, |row, column, c| out[row * width + column] += c);
    }

    /// Which entries of the regressor can differ from 0, in its layout: a joint feels only what
    /// hangs on it, and the drives that act on it.
    pub fn regressor_pattern(&self) -> Vec<bool> {
        let (n, width) = (self.joints(), self.parameter_names().len());
        let mut pattern = vec![false; n * width];
        for (link, &first) in self.first_columns.iter().enumerate() {
            for row in pattern.chunks_mut(width).take(link + 1) {
                row[first..first + 10].fill(true);
            }
        }
        let any = &[0.0; MAX_JOINTS][..n];
        self.drives.for_each_inertia(any, |row, column, _| pattern[row * width + column] = true);
        self.drives.for_each_friction(any, |row, column, _| pattern[row * width + column] = true);
        pattern
    }
}

/// c · N + b · F by the link's ten parameters, with N and F of
/// [`Inertia::wrench`](super::inertia::Inertia::wrench):
///
/// J:  cᵀ J ω̇ + (c × ω)ᵀ J ω      ms:  ms · (a × c + b × ω̇ + (b × ω) × ω)      m:  b · a
fn link_columns<T: Scalar>(turn: Vector3<T>, shift: Vector3<T>, motion: &Motion<T>) -> [T; 10] {
    let w = motion.angular_velocity;
    let dw = motion.angular_acceleration;
    let a = motion.acceleration;
    let e = turn.cross(w);
    let ms = a.cross(turn) + shift.cross(dw) + shift.cross(w).cross(w);
    [
        turn.x * dw.x + e.x * w.x,
        turn.x * dw.y + turn.y * dw.x + e.x * w.y + e.y * w.x,
        turn.x * dw.z + turn.z * dw.x + e.x * w.z + e.z * w.x,
        turn.y * dw.y + e.y * w.y,
        turn.y * dw.z + turn.z * dw.y + e.y * w.z + e.z * w.y,
        turn.z * dw.z + e.z * w.z,
        ms.x,
        ms.y,
        ms.z,
        shift.dot(a),
    ]
}
