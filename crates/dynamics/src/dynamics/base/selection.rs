//! Basis of the columns of an observation matrix, and the dependence of the other columns on it.

use nalgebra::{DMatrix, DVector};

use super::error::BaseParametersError;

/// Least length of the part outside the basis of an independent column of unit length.
const MIN_INDEPENDENT_LENGTH: f64 = 1e-7;
/// Largest length of that part for a dependent column. Between both limits, no decision is
/// possible.
const MAX_DEPENDENT_LENGTH: f64 = 1e-10;
/// Length relative to the longest column below which a column has no effect.
const NO_EFFECT: f64 = 1e-12;

/// Basis of the columns of an observation matrix.
pub struct ColumnSelection {
    /// Basis columns, ascending.
    pub basis: Vec<usize>,
    /// Columns without effect, ascending.
    pub without_effect: Vec<usize>,
    /// b × p: every column as a combination of the basis.
    pub regrouping: DMatrix<f64>,
}

/// Takes columns in the order of `preference` as long as they are independent of those taken. Their
/// number is checked against the rank by QR with pivoting on the column norm.
///
/// # Errors
/// A column that is neither clearly dependent nor clearly independent.
pub fn select_columns(
    observation: &DMatrix<f64>,
    preference: &[usize],
) -> Result<ColumnSelection, BaseParametersError> {
    // The triangle has the same lengths and products of the columns in far fewer rows.
    let observation = &observation.clone().qr().r();
    let lengths: Vec<f64> = observation.column_iter().map(|column| column.norm()).collect();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let (effective, without_effect): (Vec<usize>, Vec<usize>) =
        (0..observation.ncols()).partition(|&column| lengths[column] > NO_EFFECT * longest);
    let unit = |column: usize| observation.column(column) / lengths[column];

    let rank = rank(effective.iter().map(|&column| unit(column)).collect())?;
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let mut chosen = Vec::new();
    for &column in preference.iter().filter(|column| !without_effect.contains(column)) {
        let outside = orthogonal_part(&basis, unit(column));
        let length = outside.norm();
        if length > MIN_INDEPENDENT_LENGTH {
            basis.push(outside / length);
            chosen.push(column);
        } else if length > MAX_DEPENDENT_LENGTH {
            return Err(BaseParametersError::AmbiguousRank { length });
        }
    }
    if chosen.len() != rank {
        return Err(BaseParametersError::RankMismatch { chosen: chosen.len(), rank });
    }

    chosen.sort_unstable();
    let mut regrouping = DMatrix::zeros(chosen.len(), observation.ncols());
    let (q, r) = qr_factors(&chosen.iter().map(|&column| unit(column)).collect::<Vec<_>>());
    for &column in &effective {
        if let Ok(row) = chosen.binary_search(&column) {
            regrouping[(row, column)] = 1.0;
            continue;
        }
        // β of W_kept β = w. The system is triangular, because the kept columns are independent.
        let share = r.solve_upper_triangular(&q.tr_mul(&unit(column)));
        let Some(share) = share else {
            return Err(BaseParametersError::RankMismatch { chosen: chosen.len(), rank });
        };
        for (row, &share) in
            share.iter().enumerate().filter(|(_, share)| share.abs() > MAX_DEPENDENT_LENGTH)
        {
            regrouping[(row, column)] = share * lengths[column] / lengths[chosen[row]];
        }
    }
    Ok(ColumnSelection { basis: chosen, without_effect, regrouping })
}

/// Returns the rank of unit columns, by Gram–Schmidt that always takes the column with the largest
/// remainder.
fn rank(mut columns: Vec<DVector<f64>>) -> Result<usize, BaseParametersError> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    loop {
        let lengths = columns.iter().map(|column| column.norm());
        let longest = lengths.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
        let Some((index, _)) = longest else { break };
        // Orthogonalised again against the basis, because the remainder of a short column is mostly
        // rounding.
        let pivot = orthogonal_part(&basis, columns.swap_remove(index));
        let length = pivot.norm();
        if length <= MAX_DEPENDENT_LENGTH {
            break;
        }
        if length <= MIN_INDEPENDENT_LENGTH {
            return Err(BaseParametersError::AmbiguousRank { length });
        }
        let pivot = pivot / length;
        for column in &mut columns {
            let share = pivot.dot(column);
            column.axpy(-share, &pivot, 1.0);
        }
        basis.push(pivot);
    }
    Ok(basis.len())
}

/// Returns the part of a vector outside an orthonormal basis, computed twice for full accuracy
/// (Kahan).
fn orthogonal_part(basis: &[DVector<f64>], mut vector: DVector<f64>) -> DVector<f64> {
    for _ in 0..2 {
        for direction in basis {
            let share = direction.dot(&vector);
            vector.axpy(-share, direction, 1.0);
        }
    }
    vector
}

/// Returns Q and R of independent columns.
fn qr_factors(columns: &[DVector<f64>]) -> (DMatrix<f64>, DMatrix<f64>) {
    if columns.is_empty() {
        return (DMatrix::zeros(0, 0), DMatrix::zeros(0, 0));
    }
    let qr = DMatrix::from_columns(columns).qr();
    (qr.q(), qr.r())
}
