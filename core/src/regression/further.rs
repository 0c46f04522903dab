//! Columns beside an observation matrix, of one joint at a time.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::observation_matrix::{ObservationMatrix, ROWS_AT_ONCE};
use super::products::symmetric_product;

/// Columns C (r × m) beside X. They need not be in memory together.
pub trait FurtherColumns {
    /// Their number m.
    fn count(&self) -> usize;

    /// Those that act on a joint, in its rows.
    fn of_joint(&self, joint: usize) -> Vec<FurtherColumn<'_>>;

    /// C η (r).
    fn times(&self, freedoms: &DVector<f64>) -> DVector<f64>;
}

/// One of them in the rows of a joint.
pub struct FurtherColumn<'a> {
    /// Its number among all.
    pub number: usize,
    /// What the values are multiplied by.
    pub factor: f64,
    /// N values, which several columns may share.
    pub values: Cow<'a, [f64]>,
}

impl FurtherColumns for ObservationMatrix {
    fn count(&self) -> usize {
        self.ncols()
    }

    fn of_joint(&self, joint: usize) -> Vec<FurtherColumn<'_>> {
        let column = |(number, values)| {
            let values = Cow::Borrowed(values);
            FurtherColumn { number, factor: 1.0, values }
        };
        Self::of_joint(self, joint).map(column).collect()
    }

    fn times(&self, freedoms: &DVector<f64>) -> DVector<f64> {
        Self::times(self, freedoms)
    }
}

/// `AᵀA` of the rows A = (X C) of one joint ((b + m) × (b + m)).
pub(crate) fn gram(
    matrix: &ObservationMatrix,
    further: &dyn FurtherColumns,
    joint: usize,
) -> DMatrix<f64> {
    let columns = further.of_joint(joint);
    let own = matrix.ncols();
    let numbers = columns.iter().map(|column| own + column.number);
    let places: Vec<usize> = matrix.columns_of(joint).into_iter().chain(numbers).collect();
    let compact = gram_of_joint(matrix, joint, &columns);
    spread(&compact, &places, own + further.count())
}

/// That of the columns alone that act on the joint, of which these are C.
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
        let own = block.ncols();
        block = block.resize_horizontally(own + columns.len(), 0.0);
        for (column, mut to) in columns.iter().zip(block.column_iter_mut().skip(own)) {
            let values = &column.values[first..first + count];
            to.iter_mut().zip(values).for_each(|(to, value)| *to = column.factor * value);
        }
        let product = symmetric_product(&block, &block);
        gram = if gram.is_empty() { product } else { gram + product };
    }
    gram
}

/// A symmetric matrix of some of so many columns, with 0 for all others.
pub(super) fn spread(compact: &DMatrix<f64>, places: &[usize], size: usize) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(size, size);
    for (j, to) in places.iter().enumerate() {
        for (i, from) in places.iter().enumerate() {
            all[(*from, *to)] = compact[(i, j)];
        }
    }
    all
}
