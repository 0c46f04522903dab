//! Which columns of an observation matrix form a basis, and how the others depend on it.

use nalgebra::{DMatrix, DVector};

use super::error::BaseParametersError;

/// A column of unit length whose part outside the basis is at least this long is independent.
const INDEPENDENT: f64 = 1e-7;
/// One whose part is at most this long is dependent; in between, nothing can be said.
const DEPENDENT: f64 = 1e-10;
/// A column shorter than this share of the longest one has no effect.
const NO_EFFECT: f64 = 1e-12;

/// A basis of the columns.
pub(crate) struct Selection {
    /// Basis columns, ascending.
    pub(crate) kept: Vec<usize>,
    /// Columns without effect, ascending.
    pub(crate) without_effect: Vec<usize>,
    /// b × p: every column as a combination of the basis.
    pub(crate) regrouping: DMatrix<f64>,
}

/// Takes columns in the order of `preference` as long as they are independent of those taken. The
/// number of them is checked against the rank by QR with pivoting on the column norm.
pub(crate) fn select(
    observation: &DMatrix<f64>,
    preference: &[usize],
) -> Result<Selection, BaseParametersError> {
    let lengths: Vec<f64> = observation.column_iter().map(|column| column.norm()).collect();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let (effective, without_effect): (Vec<usize>, Vec<usize>) =
        (0..observation.ncols()).partition(|&column| lengths[column] > NO_EFFECT * longest);
    let unit = |column: usize| observation.column(column) / lengths[column];

    let rank = rank(effective.iter().map(|&column| unit(column)).collect())?;
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let mut kept = Vec::new();
    for &column in preference.iter().filter(|column| !without_effect.contains(column)) {
        let outside = outside(&basis, unit(column));
        let length = outside.norm();
        if length > INDEPENDENT {
            basis.push(outside / length);
            kept.push(column);
        } else if length > DEPENDENT {
            return Err(BaseParametersError::AmbiguousRank { length });
        }
    }
    if kept.len() != rank {
        return Err(BaseParametersError::RankMismatch { chosen: kept.len(), rank });
    }

    kept.sort_unstable();
    let mut regrouping = DMatrix::zeros(kept.len(), observation.ncols());
    let (q, r) = orthogonal(&kept.iter().map(|&column| unit(column)).collect::<Vec<_>>());
    for &column in &effective {
        if let Ok(row) = kept.binary_search(&column) {
            regrouping[(row, column)] = 1.0;
            continue;
        }
        // β of W_kept β = w: triangular, as the kept columns are independent.
        let share = r.solve_upper_triangular(&q.tr_mul(&unit(column)));
        let Some(share) = share else {
            return Err(BaseParametersError::RankMismatch { chosen: kept.len(), rank });
        };
        for (row, &share) in share.iter().enumerate().filter(|(_, share)| share.abs() > DEPENDENT) {
            regrouping[(row, column)] = share * lengths[column] / lengths[kept[row]];
        }
    }
    Ok(Selection { kept, without_effect, regrouping })
}

/// The rank of unit columns, by Gram–Schmidt that always takes the column of which most is left.
fn rank(mut columns: Vec<DVector<f64>>) -> Result<usize, BaseParametersError> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    loop {
        let lengths = columns.iter().map(|column| column.norm());
        let longest = lengths.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
        let Some((index, _)) = longest else { break };
        // Once more against the basis: what is left of a short column is mostly rounding.
        let pivot = outside(&basis, columns.swap_remove(index));
        let length = pivot.norm();
        if length <= DEPENDENT {
            break;
        }
        if length <= INDEPENDENT {
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

/// The part of a vector outside an orthonormal basis; twice, for full accuracy (Kahan).
fn outside(basis: &[DVector<f64>], mut vector: DVector<f64>) -> DVector<f64> {
    for _ in 0..2 {
        for direction in basis {
            let share = direction.dot(&vector);
            vector.axpy(-share, direction, 1.0);
        }
    }
    vector
}

/// Q and R of independent columns.
fn orthogonal(columns: &[DVector<f64>]) -> (DMatrix<f64>, DMatrix<f64>) {
    if columns.is_empty() {
        return (DMatrix::zeros(0, 0), DMatrix::zeros(0, 0));
    }
    let qr = DMatrix::from_columns(columns).qr();
    (qr.q(), qr.r())
}
