//! The direct dynamic model: the acceleration that torques cause.

use thiserror::Error;

use super::{Model, Workspace};
use crate::scalar::Scalar;

/// The parameters do not make an arm: its mass matrix is not positive definite at this posture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "the mass matrix is not positive definite at joint {joint}; raise the inertia parameters \
     that joint {joint} moves, first of all its drive inertia"
)]
pub struct NotPositiveDefinite {
    /// The first joint, counted from 1, whose pivot is not positive.
    pub joint: usize,
}

impl Model {
    /// The joint accelerations q̈ = M⁻¹ (τ − h) \[rad/s² or m/s²\] by Cholesky factorisation of the
    /// mass matrix, which needs no single link to be a physical body.
    ///
    /// # Errors
    /// When the mass matrix is not positive definite; `ddq` is then undefined.
    ///
    /// # Panics
    /// When a slice is not of the model's size: p parameters, n entries for each of the others.
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

    /// The same with `less` taken off the diagonal of the mass matrix, one inertia per joint or
    /// none at all: what moves by itself there.
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
        self.check_joints(tau);
        // The poses that the bias leaves in the workspace serve the mass matrix.
        self.bias(ws, parameters, q, dq, ddq);
        for (ddq, tau) in ddq.iter_mut().zip(tau) {
            *ddq = *tau - *ddq;
        }
        self.composite(ws, parameters);
        let n = self.joints();
        for (j, (row, less)) in ws.mass[..n].iter_mut().zip(less).enumerate() {
            row[j] -= *less;
        }
        factorise(&mut ws.mass[..n])?;
        solve(&ws.mass[..n], ddq);
        Ok(())
    }

    /// Solves M X = B in place for B with `width` columns (n × width, row-major), with the mass
    /// matrix that [`direct_dynamics`](Self::direct_dynamics) has factorised in the workspace.
    pub(super) fn solve_mass(&self, ws: &Workspace<f64>, width: usize, b: &mut [f64]) {
        let factor = &ws.mass[..self.joints()];
        let subtract = |to: &mut [f64], share: f64, from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to -= share * from;
            }
        };
        for (j, row) in factor.iter().enumerate() {
            let (done, rest) = b.split_at_mut(j * width);
            for (l, done) in row.iter().zip(done.chunks_exact(width)) {
                subtract(&mut rest[..width], *l, done);
            }
            rest[..width].iter_mut().for_each(|x| *x *= row[j]);
        }
        for j in (0..factor.len()).rev() {
            let (rest, done) = b.split_at_mut((j + 1) * width);
            let x = &mut rest[j * width..];
            for (row, done) in factor[j + 1..].iter().zip(done.chunks_exact(width)) {
                subtract(x, row[j], done);
            }
            x.iter_mut().for_each(|x| *x *= factor[j][j]);
        }
    }
}

/// Smallest share of a diagonal entry that a pivot may keep: below it, only rounding is left.
const SMALLEST_PIVOT: f64 = 1e-13;

/// M = L Lᵀ, L in place of the lower triangle; the diagonal holds the inverse of L's.
fn factorise<T: Scalar, const N: usize>(mass: &mut [[T; N]]) -> Result<(), NotPositiveDefinite> {
    for j in 0..mass.len() {
        let (done, rest) = mass.split_at_mut(j);
        let row = &mut rest[0];
        for (k, previous) in done.iter().enumerate() {
            let mut entry = row[k];
            for i in 0..k {
                entry -= row[i] * previous[i];
            }
            row[k] = entry * previous[k];
        }
        let diagonal = row[j];
        let mut pivot = diagonal;
        for entry in &row[..j] {
            pivot -= *entry * *entry;
        }
        if !(pivot - diagonal * T::constant(SMALLEST_PIVOT)).all_positive() {
            return Err(NotPositiveDefinite { joint: j + 1 });
        }
        row[j] = T::constant(1.0) / pivot.sqrt();
    }
    Ok(())
}

/// Solves L Lᵀ x = b in place.
fn solve<T: Scalar, const N: usize>(factor: &[[T; N]], x: &mut [T]) {
    for (j, row) in factor.iter().enumerate() {
        let mut value = x[j];
        for (l, x) in row[..j].iter().zip(x.iter()) {
            value -= *l * *x;
        }
        x[j] = value * row[j];
    }
    for j in (0..factor.len()).rev() {
        let mut value = x[j];
        for i in j + 1..factor.len() {
            value -= factor[i][j] * x[i];
        }
        x[j] = value * factor[j][j];
    }
}
