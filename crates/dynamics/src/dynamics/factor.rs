//! Factorised mass matrix.

use crate::robot::JointIndex;
use thiserror::Error;

use crate::MAX_JOINTS;
use crate::numeric::Scalar;

/// The parameters do not describe an arm: its mass matrix is not positive definite in this posture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "the mass matrix is not positive definite at joint {joint}; raise the inertia parameters \
     that joint {joint} moves, first of all its drive inertia"
)]
pub struct NotPositiveDefinite {
    /// Joint nearest to the tip whose inertia, with all joints after it free, is not positive.
    pub joint: JointIndex,
}

/// Smallest share of a diagonal entry that a pivot may keep. Below it, only rounding remains.
const SMALLEST_PIVOT: f64 = 1e-13;

/// Mass matrix as U D Uᵀ, with ones on the diagonal of the upper triangle U. The order is from the
/// tip to the base, so that each row can be factorised as soon as it is known.
#[derive(Clone, Debug)]
pub(super) struct MassMatrixFactor<T> {
    /// U to the right of the diagonal.
    pub(super) unit: [[T; MAX_JOINTS]; MAX_JOINTS],
    /// D⁻¹: the reciprocal of each joint's inertia while all joints after it are free.
    pub(super) inverse: [T; MAX_JOINTS],
}

impl<T: Scalar> MassMatrixFactor<T> {
    pub(super) fn zero() -> Self {
        let zero = [T::zero(); MAX_JOINTS];
        Self { unit: [zero; MAX_JOINTS], inverse: zero }
    }

    /// Turns row i of M, from its diagonal on, into row i of the factor. The rows after it are
    /// done.
    ///
    /// ```text
    /// U_ij D_j = M_ij − Σ_{k>j} U_ik D_k U_jk     D_i = M_ii − Σ_{k>i} U_ik D_k U_ik
    /// ```
    #[inline(always)]
    pub(super) fn factorise_row<const N: usize>(
        &mut self,
        n: usize,
        i: usize,
        row: &mut [T; N],
    ) -> Result<(), NotPositiveDefinite> {
        let Self { unit, inverse } = self;
        // The entries are those of U D; they are divided by D below.
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
            return Err(NotPositiveDefinite { joint: JointIndex::new(i) });
        }
        inverse[i] = T::constant(1.0) / pivot;
        Ok(())
    }
}
