//! Joint-space mass matrix.

use super::composite::OuterLinks;
use super::model::Model;
use super::workspace::Workspace;
use crate::numeric::Scalar;

impl Model {
    /// Computes the mass matrix M(φ, q), n × n, row-major, symmetric: links by composite bodies
    /// (Featherstone, *Rigid Body Dynamics Algorithms*, ch. 6.2) and drive inertias.
    ///
    /// # Panics
    /// If a slice does not have the model's size: p parameters, n positions, n × n entries.
    pub fn mass_matrix<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        out: &mut [T],
    ) {
        self.assert_parameter_count(parameters);
        self.check_joints(q);
        let n = self.joints();
        assert_eq!(out.len(), n * n, "one row and one column per joint");
        T::vectorised(
            #[inline(always)]
            || {
                self.compute_poses(ws, q);
                out.fill(T::zero());
                self.drives.for_each_mass(parameters, |row, column, value| {
                    out[row * n + column] += value;
                });
                let mut outer = OuterLinks::empty();
                for j in (0..self.heavy_links(parameters)).rev() {
                    outer.add_link(self.link(parameters, j), self.chain[j].kind, &ws.poses, j);
                    for (k, wrench) in outer.unit_wrenches(j) {
                        let felt = wrench.generalised_force(self.chain[j].kind);
                        out[j * n + k] += felt;
                        if k != j {
                            out[k * n + j] += felt;
                        }
                    }
                }
            },
        );
    }
}
