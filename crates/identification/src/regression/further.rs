//! Additional columns of an observation matrix, for one joint at a time.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::observation_matrix::{ObservationMatrix, ROWS_AT_ONCE};
use super::products::symmetric_product;

/// Additional columns C (r × m) next to X. Not all of them need to be in memory at the same time.
pub trait FurtherColumns {
    /// Returns the number m of columns.
    fn count(&self) -> usize;

    /// Returns the columns that act on a joint, in its rows.
    fn of_joint(&self, joint: usize) -> Vec<FurtherColumn<'_>>;

    /// Returns C η (r).
    fn weighted_sum(&self, nuisance: &DVector<f64>) -> DVector<f64>;
}

/// Additional column in the rows of a joint.
pub struct FurtherColumn<'a> {
    /// Number of the column among all additional columns.
    pub number: usize,
    /// Factor of the values.
    pub factor: f64,
    /// N values, which several columns may share.
    pub values: Cow<'a, [f64]>,
}

impl FurtherColumns for ObservationMatrix {
    fn count(&self) -> usize {
        self.ncols()
    }

    fn of_joint(&self, joint: usize) -> Vec<FurtherColumn<'_>> {
        Self::of_joint(self, joint)
            .map(|(number, values)| {
                let values = Cow::Borrowed(values);
                FurtherColumn { number, factor: 1.0, values }
            })
            .collect()
    }

    fn weighted_sum(&self, nuisance: &DVector<f64>) -> DVector<f64> {
        Self::times_parameters(self, nuisance)
    }
}

/// Returns `AᵀA` of the rows A = (X C) of one joint ((b + m) × (b + m)).
pub(crate) fn gram_matrix(
    matrix: &ObservationMatrix,
    further: &dyn FurtherColumns,
    joint: usize,
) -> DMatrix<f64> {
    let columns = further.of_joint(joint);
    let width = matrix.ncols();
    let numbers = columns.iter().map(|column| width + column.number);
    let places: Vec<usize> = matrix.columns_of(joint).into_iter().chain(numbers).collect();
    let compact = gram_of_joint(matrix, joint, &columns);
    expand_columns(&compact, &places, width + further.count())
}

/// Returns the same matrix for the columns that act on the joint only; `columns` are those of C.
pub(super) fn gram_of_joint(
    matrix: &ObservationMatrix,
    joint: usize,
    columns: &[FurtherColumn<'_>],
) -> DMatrix<f64> {
    let rows = matrix.rows_per_joint();
    let mut gram = DMatrix::zeros(0, 0);
    for first in (0..rows).step_by(ROWS_AT_ONCE) {
        let count = ROWS_AT_ONCE.min(rows - first);
        let mut block = matrix.rows_of(joint, first..first + count);
        let width = block.ncols();
        block = block.resize_horizontally(width + columns.len(), 0.0);
        for (column, mut to) in columns.iter().zip(block.column_iter_mut().skip(width)) {
            let values = &column.values[first..first + count];
            to.iter_mut().zip(values).for_each(|(to, value)| *to = column.factor * value);
        }
        let product = symmetric_product(&block, &block);
        gram = if gram.is_empty() { product } else { gram + product };
    }
    gram
}

/// Expands a symmetric matrix of some columns to all columns, with 0 for the others.
pub(super) fn expand_columns(
    compact: &DMatrix<f64>,
    places: &[usize],
    size: usize,
) -> DMatrix<f64> {
    let mut expanded = DMatrix::zeros(size, size);
    for (j, to) in places.iter().enumerate() {
        for (i, from) in places.iter().enumerate() {
            expanded[(*from, *to)] = compact[(i, j)];
        }
    }
    expanded
}
