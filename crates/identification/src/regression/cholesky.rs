//! Cholesky decomposition of small matrices with vector instructions (Golub & Van Loan, *Matrix
//! Computations*, section 4.2).

use nalgebra::{DMatrix, DVector};

use super::products::{dot, subtract_scaled, symmetric_product};
use didim_dynamics::numeric::with_vector_instructions;

/// Lower triangle L of A = L Lᵀ.
#[derive(Clone, Debug)]
pub(crate) struct CholeskyFactor(DMatrix<f64>);

impl CholeskyFactor {
    /// Decomposes a symmetric matrix, of which only the lower triangle is read. `None` if it is not
    /// positive definite.
    pub(crate) fn new(mut matrix: DMatrix<f64>) -> Option<Self> {
        let size = matrix.nrows();
        let is_positive = with_vector_instructions(
            #[inline(always)]
            || {
                let mut rest = matrix.as_mut_slice();
                // Column k starts at its diagonal, and the columns after it follow.
                for k in 0..size {
                    let (column, after) = rest.split_at_mut(size);
                    let column = &mut column[k..];
                    let pivot = column[0];
                    if pivot.is_nan() || pivot <= 0.0 {
                        return false;
                    }
                    let scale = 1.0 / pivot.sqrt();
                    column.iter_mut().for_each(|value| *value *= scale);
                    for (j, other) in after.chunks_exact_mut(size).enumerate() {
                        let below = &column[j + 1..];
                        subtract_scaled(&mut other[k + j + 1..], below[0], below);
                    }
                    rest = after;
                }
                true
            },
        );
        is_positive.then_some(Self(matrix))
    }

    /// Replaces b by the solution of A x = b.
    pub(crate) fn solve(&self, right: &mut [f64]) {
        with_vector_instructions(
            #[inline(always)]
            || self.solve_lower(right, 0),
        );
        with_vector_instructions(
            #[inline(always)]
            || self.solve_upper(right),
        );
    }

    /// Returns A⁻¹.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        let of_triangle = self.inverse_of_triangle();
        symmetric_product(&of_triangle, &of_triangle)
    }

    /// Returns the diagonal of A⁻¹.
    pub(crate) fn inverse_diagonal(&self) -> DVector<f64> {
        let of_triangle = self.inverse_of_triangle();
        let squares = of_triangle.column_iter().map(|column| column.norm_squared());
        DVector::from_iterator(of_triangle.ncols(), squares)
    }

    /// Returns L⁻¹.
    fn inverse_of_triangle(&self) -> DMatrix<f64> {
        let size = self.0.nrows();
        let mut of_triangle = DMatrix::identity(size, size);
        let columns = of_triangle.as_mut_slice().chunks_exact_mut(size.max(1)).enumerate();
        with_vector_instructions(
            #[inline(always)]
            || columns.for_each(|(j, column)| self.solve_lower(column, j)),
        );
        of_triangle
    }

    /// Returns the columns of L, each with its place.
    #[inline(always)]
    fn columns(&self) -> impl DoubleEndedIterator<Item = (usize, &[f64])> + ExactSizeIterator {
        self.0.as_slice().chunks_exact(self.0.nrows().max(1)).enumerate()
    }

    /// Replaces b, whose entries before `first` are 0, by the solution of L x = b.
    #[inline(always)]
    fn solve_lower(&self, right: &mut [f64], first: usize) {
        for (k, column) in self.columns().skip(first) {
            let (own, rest) = right[k..].split_at_mut(1);
            own[0] /= column[k];
            subtract_scaled(rest, own[0], &column[k + 1..]);
        }
    }

    /// Replaces b by the solution of Lᵀ x = b.
    #[inline(always)]
    fn solve_upper(&self, right: &mut [f64]) {
        for (k, column) in self.columns().rev() {
            let (own, solved) = right[k..].split_at_mut(1);
            own[0] = (own[0] - dot(&column[k + 1..], solved)) / column[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_that_of_nalgebra() {
        for size in [0, 1, 2, 5, 28, 37] {
            let half = DMatrix::from_fn(size + 3, size, |i, j| {
                (((i * 31 + j * 17) * 53) % 101) as f64 / 101.0 - 0.5
            });
            let matrix = half.tr_mul(&half) + DMatrix::identity(size, size);
            let factor = CholeskyFactor::new(matrix.clone()).unwrap();
            let expected = nalgebra::Cholesky::new(matrix.clone()).unwrap();
            let right = nalgebra::DVector::from_fn(size, |k, _| k as f64 - 3.0);
            let mut solution = right.clone();
            factor.solve(solution.as_mut_slice());
            let scale = expected.inverse().amax();
            assert!((solution - expected.solve(&right)).amax() <= 1e-11 * scale, "{size}");
            let difference = factor.inverse() - expected.inverse();
            assert!(difference.amax() <= 1e-12 * scale, "{size}");
        }
    }

    #[test]
    fn what_is_not_positive_has_none() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]);
        assert!(CholeskyFactor::new(matrix.clone()).is_none());
        assert!(CholeskyFactor::new(matrix * f64::NAN).is_none());
    }
}
