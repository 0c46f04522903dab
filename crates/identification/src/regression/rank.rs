//! Test for independent columns of a matrix, and search for the dependent ones.

use nalgebra::{DMatrix, SVD};

use super::error::RegressionError;

/// Share of the null vector, relative to the largest share, above which a column takes part in a
/// dependency. Smaller shares are rounding.
const NULL_VECTOR_SHARE: f64 = 1e-6;

/// Length of a column, relative to the longest one, below which it holds only rounding.
/// Differentiating a constant twice at some kHz leaves this much. In SI units no parameter of an
/// arm is so far from the others.
const ZERO_COLUMN: f64 = 1e-12;

/// Fraction of their norms to which dependent columns depend on each other. They differ by rounding
/// alone: the filters leave this much of it in the columns of an arm at rest.
const DEPENDENCY_TOLERANCE: f64 = 1e-12;

/// Largest number of iterations of a singular value decomposition. It is far more than ever needed,
/// but bounded.
const MAX_SVD_ITERATIONS: usize = 10_000;

/// Rejects a triangular factor R whose columns are not independent relative to their own norms.
///
/// Columns have different units, so R is judged after each is scaled to norm 1. R is deficient if
/// the smallest singular value is below `rows · ε` of the largest (the convention of LAPACK and
/// NumPy) or below the filters' rounding of 0. R has the column norms and the singular values of
/// the tall matrix of `rows` rows it came from. If R has an inverse, it shows for most matrices
/// without singular values that they are not deficient.
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

    // The columns have norm 1, so the largest singular value is at most √b. The smallest is at
    // least 1 over the Frobenius norm of the inverse. Half of it allows for the inverse's own
    // rounding.
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

/// Returns the singular values of R, largest first. They are those of the tall matrix it came from.
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
