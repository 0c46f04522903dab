//! Direct dynamic model: the acceleration that torques cause, by the composite-rigid-body algorithm
//! (Featherstone, *Rigid Body Dynamics Algorithms*, ch. 6.2) with a U D Uᵀ factorisation row by row
//! (Golub & Van Loan, *Matrix Computations*, section 4.1).

use super::composite::OuterLinks;
use super::factor::{MassMatrixFactor, NotPositiveDefinite};
use super::inertia::Wrench;
use super::model::Model;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::sample::FEW_JOINTS;

impl Model {
    /// Computes the joint accelerations q̈ = M⁻¹ (τ − h) \[rad/s² or m/s²\] by factorisation of the
    /// mass matrix. No single link has to be a physical body.
    ///
    /// # Errors
    /// If the mass matrix is not positive definite; `ddq` is then undefined. If several arms are
    /// computed side by side ([`Lanes`](crate::numeric::Lanes)), one such arm fails all.
    ///
    /// # Panics
    /// If a slice does not have the model's size: p parameters, n entries for each of the others.
    pub fn direct_dynamics<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        q: &[T],
        dq: &[T],
        tau: &[T],
        ddq: &mut [T],
    ) -> Result<(), NotPositiveDefinite> {
        self.direct_dynamics_without(ws, parameters, &[], q, dq, tau, ddq)
    }

    /// Computes the same with `less` subtracted from the diagonal of the mass matrix: the inertia
    /// of each joint that moves separately. An empty slice subtracts nothing.
    pub(crate) fn direct_dynamics_without<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        less: &[T],
        q: &[T],
        dq: &[T],
        tau: &[T],
        ddq: &mut [T],
    ) -> Result<(), NotPositiveDefinite> {
        self.assert_parameter_count(parameters);
        self.check_joints(q);
        self.check_joints(dq);
        self.check_joints(tau);
        self.check_joints(ddq);
        if self.has_few_joints() {
            return T::vectorised(
                #[inline(always)]
                || self.solve_inward::<T, FEW_JOINTS>(ws, parameters, less, q, dq, tau, ddq),
            );
        }
        T::vectorised(
            #[inline(always)]
            || self.solve_inward::<T, MAX_JOINTS>(ws, parameters, less, q, dq, tau, ddq),
        )
    }

    /// Computes the bias of link j, row j of the mass matrix, and its contributions to the
    /// factorisation and to the solution. It is one recursion from the tip to the base. While one
    /// link waits for a division, the sums of the next link are computed. The arm has at most `N`
    /// joints.
    #[inline(always)]
    pub(super) fn solve_inward<T: Scalar, const N: usize>(
        &self,
        ws: &mut Workspace<T>,
        parameters: &[T],
        less: &[T],
        q: &[T],
        dq: &[T],
        tau: &[T],
        ddq: &mut [T],
    ) -> Result<(), NotPositiveDefinite> {
        // The bound lets the compiler omit checks.
        let n = self.joints().min(N);
        let mut friction: [T; N] = self.friction_torques(ws, parameters, dq);
        self.take_off_known(q, &mut friction);
        self.compute_poses_up_to::<T, N>(ws, q);
        self.add_load_friction(ws, parameters, [q, dq], &mut friction);
        let links = self.heavy_links(parameters);
        self.compute_motions(ws, links, dq, None);

        let Workspace { poses, motions, factor, .. } = ws;
        let mut outer = OuterLinks::<T, N>::empty();
        let mut transferred = Wrench::zero();
        for i in (0..n).rev() {
            let mut row = [T::zero(); N];
            self.drives.for_each_mass_in_row(i, parameters, |column, value| row[column] += value);
            if let Some(less) = less.get(i) {
                row[i] -= *less;
            }
            let mut rest = tau[i] - friction[i];
            if i < links {
                let kind = self.chain[i].kind;
                let link = self.link(parameters, i);
                outer.add_link(link, kind, poses, i);
                for (j, wrench) in outer.unit_wrenches(i) {
                    row[j] += wrench.generalised_force(kind);
                }
                let total = link.wrench(&motions[i]).combined(transferred);
                rest -= total.generalised_force(kind);
                transferred = total.to_previous(&poses[i]);
            }
            factor.factorise_row(n, i, &mut row)?;
            // U y = τ − h
            for (share, solved) in factor.unit[i][i + 1..n].iter().zip(&ddq[i + 1..n]) {
                rest -= *share * *solved;
            }
            ddq[i] = rest;
        }
        // D Uᵀ q̈ = y
        for i in 0..n {
            let mut acceleration = ddq[i] * factor.inverse[i];
            for (row, solved) in factor.unit[..N].iter().zip(&ddq[..i]) {
                acceleration -= row[i] * *solved;
            }
            ddq[i] = acceleration;
        }
        Ok(())
    }

    /// Solves M X = B in place for B with `width` columns (n × width, row-major), with the mass
    /// matrix that [`direct_dynamics`](Self::direct_dynamics) has factorised in the workspace.
    #[inline(always)]
    pub(super) fn solve_mass(&self, ws: &Workspace<f64>, width: usize, b: &mut [f64]) {
        let MassMatrixFactor { unit, inverse, .. } = &ws.factor;
        let n = self.joints();
        for i in (0..n).rev() {
            let (rest, done) = b.split_at_mut((i + 1) * width);
            let y = &mut rest[i * width..];
            for (share, done) in unit[i][i + 1..].iter().zip(done.chunks_exact(width)) {
                subtract(y, *share, done);
            }
        }
        for i in 0..n {
            let (done, rest) = b.split_at_mut(i * width);
            let x = &mut rest[..width];
            x.iter_mut().for_each(|x| *x *= inverse[i]);
            for (row, done) in unit.iter().zip(done.chunks_exact(width)) {
                subtract(x, row[i], done);
            }
        }
    }
}

/// to −= share · from
#[inline(always)]
fn subtract(to: &mut [f64], share: f64, from: &[f64]) {
    // The last joints of many arms are coupled to only a few others.
    if share == 0.0 {
        return;
    }
    for (to, from) in to.iter_mut().zip(from) {
        *to -= share * from;
    }
}
