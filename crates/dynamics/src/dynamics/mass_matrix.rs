//! Joint-space mass matrix.

use super::composite::OuterLinks;
use super::model::Model;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::sample::FEW_JOINTS;

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
                if self.has_few_joints() {
                    self.mass_matrix_inward::<T, FEW_JOINTS>(ws, parameters, q, out);
                } else {
                    self.mass_matrix_inward::<T, MAX_JOINTS>(ws, parameters, q, out);
                }
            },
        );
    }

    /// Does so for an arm with at most `N` joints.
    #[inline(always)]
    fn mass_matrix_inward<T: Scalar, const N: usize>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        out: &mut [T],
    ) {
        let n = self.joints();
        self.compute_poses_up_to::<T, N>(ws, q);
        out.fill(T::zero());
        self.drives.for_each_mass(parameters, |row, column, value| {
            out[row * n + column] += value;
        });
        let mut outer = OuterLinks::<T, N>::empty();
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
    }
}
