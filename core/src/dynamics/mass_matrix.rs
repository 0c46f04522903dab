//! The joint-space mass matrix.

use super::inertia::{Inertia, Wrench};
use super::vector::Vector3;
use super::{Model, Workspace};
use crate::MAX_JOINTS;
use crate::robot::JointKind;
use crate::scalar::Scalar;

impl Model {
    /// The mass matrix M(φ, q), n × n, row-major, symmetric: links by composite bodies
    /// (Featherstone, *Rigid Body Dynamics Algorithms*, ch. 6.2) and drive inertias.
    ///
    /// # Panics
    /// When a slice is not of the model's size: p parameters, n positions, n × n entries.
    pub fn mass_matrix<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        out: &mut [T],
    ) {
        self.check_parameters(parameters);
        self.check_joints(q);
        let n = self.joints();
        assert_eq!(out.len(), n * n, "one row and one column per joint");
        self.place(ws, q);
        self.composite(ws, parameters);
        for (row, from) in out.chunks_exact_mut(n).zip(&ws.mass) {
            row.copy_from_slice(&from[..n]);
        }
    }

    /// Fills the workspace's mass matrix from its poses.
    pub(super) fn composite<T: Scalar>(&self, ws: &mut Workspace<T>, parameters: &[T]) {
        let links = self.heavy_links(parameters);
        for row in &mut ws.mass {
            *row = [T::zero(); MAX_JOINTS];
        }
        let mut body: Option<Inertia<T>> = None;
        for (j, joint) in self.chain[..links].iter().enumerate().rev() {
            // Link j and all that hangs on it, as one body in the frame of link j.
            let own = self.link(parameters, j);
            let whole = body.map_or(own, |outer| own.join(outer.to_previous(&ws.poses[j + 1])));
            // What a unit acceleration of joint j takes, felt by joint j and all before it.
            let mut wrench = unit_wrench(&whole, joint.kind);
            for i in (0..=j).rev() {
                let felt = match self.chain[i].kind {
                    JointKind::Revolute => wrench.moment.z,
                    JointKind::Prismatic => wrench.force.z,
                };
                ws.mass[i][j] = felt;
                ws.mass[j][i] = felt;
                if i > 0 {
                    wrench = wrench.to_previous(&ws.poses[i]);
                }
            }
            body = Some(whole);
        }
        self.drives.for_each_mass(parameters, |row, column, value| ws.mass[row][column] += value);
    }
}

/// The wrench for a unit acceleration along or about z of a body at rest:
/// revolute F = z × ms, N = J z; prismatic F = m z, N = ms × z.
fn unit_wrench<T: Scalar>(body: &Inertia<T>, kind: JointKind) -> Wrench<T> {
    let one = T::constant(1.0);
    let across = body.first_moment.cross_along_z(one);
    match kind {
        JointKind::Revolute => {
            Wrench { force: Vector3::zero() - across, moment: body.rotate(Vector3::along_z(one)) }
        }
        JointKind::Prismatic => Wrench { force: Vector3::along_z(body.mass), moment: across },
    }
}
