//! Test for independent columns of a matrix, and search for the dependent ones.

use nalgebra::{DMatrix, SVD};

use super::error::RegressionError;

/// Entry of the null vector, relative to its largest one, above which a column belongs to a linear
/// dependency. Smaller entries are rounding errors.
const NULL_VECTOR_SHARE: f64 = 1e-6;

/// Length of a column, relative to the longest one, below which it contains only rounding errors.
/// Differentiating a constant twice at some kHz leaves errors of this size. In SI units the columns
/// of an arm never differ this much in length.
const ZERO_COLUMN: f64 = 1e-12;

/// Relative tolerance for linear dependency of columns. Dependent columns differ only by rounding
/// errors, and the filters leave errors of this size in the columns of an arm at rest.
const DEPENDENCY_TOLERANCE: f64 = 1e-12;

/// Largest number of iterations of a singular value decomposition, far more than usually needed.
const MAX_SVD_ITERATIONS: usize = 10_000;

/// Rejects a triangular factor R whose columns are not independent relative to their own norms.
///
/// Columns have different units, so R is tested after scaling each column to norm 1. R is
/// rank-deficient if its smallest singular value is below `rows · ε` times the largest one (the
/// convention of LAPACK and NumPy), or below the rounding errors of the filters. R has the same
/// column norms and singular values as the tall matrix of `rows` rows from which it was computed.
/// In most cases the inverse of R already proves full rank, and no singular values are needed.
pub(super) fn check_rank(
    r: &DMatrix<f64>,
    inverse: Option<&DMatrix<f64>>,
    rows: usize,
) -> Result<(), RegressionError> {
    let tolerance = (rows.max(r.ncols()) as f64 * f64::EPSILON).max(DEPENDENCY_TOLERANCE);
    let norms: Vec<f64> = r.column_iter().map(|column| column.norm()).collect();
    let largest = norms.iter().copied().fold(0.0, f64::max);
    if !largest.is_finite() {
        return Err(RegressionError::OutOfRange);
    }
    let columns: Vec<usize> =
        (0..norms.len()).filter(|&c| norms[c] <= ZERO_COLUMN * largest).collect();
    if !columns.is_empty() {
        return Err(RegressionError::ZeroColumns { columns });
    }

    // The columns have norm 1, so the largest singular value is at most √b. The smallest one is at
    // least the inverse of the Frobenius norm of R⁻¹. The factor 0.5 allows for rounding errors of
    // R⁻¹.
    if let Some(inverse) = inverse {
        let squares = inverse.row_iter().zip(&norms).map(|(row, n)| n * n * row.norm_squared());
        let smallest = 0.5 / squares.sum::<f64>().sqrt();
        if smallest > tolerance * (norms.len() as f64).sqrt() {
            return Ok(());
        }
    }

    let mut scaled = r.clone();
    for (mut column, norm) in scaled.column_iter_mut().zip(&norms) {
        column /= *norm;
    }
    let svd = decompose(scaled, true)?;
    let Some(v_t) = &svd.v_t else { return Err(RegressionError::SingularValues) };
    let limit = tolerance * svd.singular_values.max();
    let mut columns: Vec<usize> = svd
        .singular_values
        .iter()
        .zip(v_t.row_iter())
        .filter(|(value, _)| **value <= limit)
        .flat_map(|(_, null)| {
            let share = NULL_VECTOR_SHARE * null.amax();
            (0..null.len()).filter(move |&c| null[c].abs() > share).collect::<Vec<_>>()
        })
        .collect();
    columns.sort_unstable();
    columns.dedup();
    if columns.is_empty() { Ok(()) } else { Err(RegressionError::DependentColumns { columns }) }
}

/// Returns the singular values of R, largest first, which are also those of the tall matrix.
pub(super) fn singular_values(r: &DMatrix<f64>) -> Result<Vec<f64>, RegressionError> {
    Ok(decompose(r.clone(), false)?.singular_values.iter().copied().collect())
}

fn decompose(
    matrix: DMatrix<f64>,
    with_v: bool,
) -> Result<SVD<f64, nalgebra::Dyn, nalgebra::Dyn>, RegressionError> {
    if !matrix.norm_squared().is_finite() {
        return Err(RegressionError::OutOfRange);
    }
    SVD::try_new(matrix, false, with_v, 5.0 * f64::EPSILON, MAX_SVD_ITERATIONS)
        .ok_or(RegressionError::SingularValues)
}
