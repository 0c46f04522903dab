//! The factorised mass matrix.

use thiserror::Error;

use crate::MAX_JOINTS;
use crate::numeric::Scalar;

/// The parameters do not make an arm: its mass matrix is not positive definite at this posture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "the mass matrix is not positive definite at joint {joint}; raise the inertia parameters \
     that joint {joint} moves, first of all its drive inertia"
)]
pub struct NotPositiveDefinite {
    /// The last joint, counted from 1, that has no inertia while all joints after it are free.
    pub joint: usize,
}

/// Smallest share of a diagonal entry that a pivot may keep: below it, only rounding is left.
const SMALLEST_PIVOT: f64 = 1e-13;

/// The mass matrix as U D Uᵀ, with ones on the diagonal of the upper triangle U: from the tip to the
/// base, so that each row can be factorised as soon as it is known.
#[derive(Clone, Debug)]
pub(super) struct Factor<T> {
    /// U to the right of the diagonal.
    pub(super) unit: [[T; MAX_JOINTS]; MAX_JOINTS],
    /// D⁻¹: of each joint the reciprocal of its inertia while all joints after it are free.
    pub(super) inverse: [T; MAX_JOINTS],
}

impl<T: Scalar> Factor<T> {
    pub(super) fn zero() -> Self {
        let zero = [T::zero(); MAX_JOINTS];
        Self { unit: [zero; MAX_JOINTS], inverse: zero }
    }

    /// Row i of M, from its diagonal on, becomes row i of the factor; the rows after it are done.
    ///
    /// ```text
    /// U_ij D_j = M_ij − Σ_{k>j} U_ik D_k U_jk     D_i = M_ii − Σ_{k>i} U_ik D_k U_ik
    /// ```
    #[inline(always)]
    pub(super) fn factorise_row(
        &mut self,
        n: usize,
        i: usize,
        row: &mut [T; MAX_JOINTS],
    ) -> Result<(), NotPositiveDefinite> {
        let Self { unit, inverse } = self;
        // U D before it is divided by D.
        for j in (i + 1..n).rev() {
            for k in j + 1..n {
                row[j] -= row[k] * unit[j][k];
            }
        }
        let diagonal = row[i];
        let mut pivot = diagonal;
        for j in i + 1..n {
            unit[i][j] = row[j] * inverse[j];
            pivot -= row[j] * unit[i][j];
        }
        if !(pivot - diagonal * T::constant(SMALLEST_PIVOT)).all_positive() {
            return Err(NotPositiveDefinite { joint: i + 1 });
        }
        inverse[i] = T::constant(1.0) / pivot;
        Ok(())
    }
}
