//! Columns beside an observation matrix, of one joint at a time.

use nalgebra::{DMatrix, DVector};

use super::observation_matrix::{ObservationMatrix, ROWS_AT_ONCE};
use super::products::symmetric_product;

/// Columns C (r × m) beside X. They need not be in memory together.
pub trait FurtherColumns {
    /// Their number m.
    fn count(&self) -> usize;

    /// Those that act on a joint, and their values in its rows (N × as many).
    fn of_joint(&self, joint: usize) -> (Vec<usize>, DMatrix<f64>);

    /// C η (r).
    fn times(&self, freedoms: &DVector<f64>) -> DVector<f64>;
}

impl FurtherColumns for ObservationMatrix {
    fn count(&self) -> usize {
        self.ncols()
    }

    fn of_joint(&self, joint: usize) -> (Vec<usize>, DMatrix<f64>) {
        (self.columns_of(joint), self.rows_of(joint, 0..self.rows_per_joint()))
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
    let (columns, values) = further.of_joint(joint);
    let own = matrix.ncols();
    let places: Vec<usize> =
        matrix.columns_of(joint).into_iter().chain(columns.iter().map(|c| own + c)).collect();
    let compact = gram_of_joint(matrix, joint, &values);
    spread(&compact, &places, own + further.count())
}

/// That of the columns alone that act on the joint, of which these are the values of C.
pub(super) fn gram_of_joint(
    matrix: &ObservationMatrix,
    joint: usize,
    values: &DMatrix<f64>,
) -> DMatrix<f64> {
    let rows = matrix.rows_per_joint();
    let mut gram = DMatrix::zeros(0, 0);
    for first in (0..rows).step_by(ROWS_AT_ONCE) {
        let count = ROWS_AT_ONCE.min(rows - first);
        let mut block = matrix.rows_of(joint, first..first + count);
        let own = block.ncols();
        block = block.resize_horizontally(own + values.ncols(), 0.0);
        block.columns_mut(own, values.ncols()).copy_from(&values.rows(first, count));
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
