//! Least squares with one weight per joint by normal equations. They have half as many digits as a
//! QR decomposition, which is enough to compare readings, and take a fraction of its time.

use nalgebra::{DMatrix, DVector};

use crate::regression::{CholeskyFactor, ObservationMatrix, symmetric_product, transposed_times};

/// Shortest column that is more than rounding, as a share of the longest one.
const SHORTEST: f64 = 1e-9;

/// Added to the squared columns, which have length 1, so that columns may depend on each other.
pub(super) const DEPENDENT: f64 = 1e-9;

/// Normal equations of a matrix for any torques and weights.
#[derive(Clone)]
pub(super) struct NormalEquations {
    joints: Vec<JointRows>,
    /// Number of columns.
    width: usize,
    /// Added to the squared columns, which have length 1, so that columns may depend on each other.
    dependence: f64,
    /// The last weights of the joints, with their factor.
    last: Option<(Vec<f64>, Factor)>,
}

/// Rows of one joint.
#[derive(Clone)]
struct JointRows {
    /// Columns that act on the joint.
    columns: Vec<usize>,
    /// These columns, Y.
    matrix: DMatrix<f64>,
    /// YᵀY.
    square: DMatrix<f64>,
    /// The last torque of the joint, and its product with Y.
    torque: Vec<f64>,
    product: DVector<f64>,
}

#[derive(Clone)]
struct Factor {
    /// Scale of each column.
    scale: DVector<f64>,
    /// Factor of the scaled matrix.
    factor: CholeskyFactor,
}

impl NormalEquations {
    /// `dependence` is added to the squared columns, scaled to length 1. It damps what contributes
    /// less than its root.
    pub(super) fn new(matrix: &ObservationMatrix, dependence: f64) -> Self {
        let joints = (0..matrix.joints()).map(|joint| JointRows::new(matrix, joint)).collect();
        Self { joints, width: matrix.ncols(), dependence, last: None }
    }

    /// Returns the solution for torques, those of each joint together, with these weights of the
    /// squared rows of each joint. `None` without a solution.
    pub(super) fn solve(&mut self, torques: &[f64], weights: &[f64]) -> Option<DVector<f64>> {
        let mut right = DVector::zeros(self.width);
        let rows = torques.len() / self.joints.len();
        for ((of, torque), weight) in
            self.joints.iter_mut().zip(torques.chunks_exact(rows)).zip(weights)
        {
            of.set_torque(torque);
            for (column, product) in of.columns.iter().zip(&of.product) {
                right[*column] += weight * product;
            }
        }
        let Factor { scale, factor } = self.factor(weights)?;
        right.component_mul_assign(scale);
        factor.solve(right.as_mut_slice());
        right.component_mul_assign(scale);
        Some(right)
    }

    /// Returns the squared residual of each joint with the last torques, relative to its squared
    /// torque. 0 for a joint without torque.
    pub(super) fn relative_squares(&self, solution: &DVector<f64>) -> Vec<f64> {
        self.joints.iter().map(|of| of.relative_square(solution)).collect()
    }

    fn factor(&mut self, weights: &[f64]) -> Option<&Factor> {
        if self.last.as_ref().is_none_or(|(last, _)| last != weights) {
            let factor = Factor::new(&self.joints, self.width, weights, self.dependence)?;
            self.last = Some((weights.to_vec(), factor));
        }
        self.last.as_ref().map(|(_, factor)| factor)
    }
}

impl JointRows {
    fn new(of: &ObservationMatrix, joint: usize) -> Self {
        let acts = |(_, values): &(usize, &[f64])| values.iter().any(|value| *value != 0.0);
        let (columns, values): (Vec<usize>, Vec<&[f64]>) = of.of_joint(joint).filter(acts).unzip();
        let matrix = DMatrix::from_vec(of.rows_per_joint(), columns.len(), values.concat());
        let square = symmetric_product(&matrix, &matrix);
        let product = DVector::zeros(columns.len());
        Self { columns, matrix, square, torque: Vec::new(), product }
    }

    /// Most readings change the torque of one joint.
    fn set_torque(&mut self, torque: &[f64]) {
        if self.torque != torque {
            self.product = transposed_times(&self.matrix, torque);
            torque.clone_into(&mut self.torque);
        }
    }

    fn relative_square(&self, solution: &DVector<f64>) -> f64 {
        let power: f64 = self.torque.iter().map(|value| value * value).sum();
        let own = solution.select_rows(&self.columns);
        let predicted = own.dot(&transposed_times(&self.square, own.as_slice()));
        let residual = power - 2.0 * self.product.dot(&own) + predicted;
        if power > 0.0 { residual.max(0.0) / power } else { 0.0 }
    }
}

impl Factor {
    fn new(joints: &[JointRows], width: usize, weights: &[f64], dependence: f64) -> Option<Self> {
        let mut normal = DMatrix::zeros(width, width);
        for (of, weight) in joints.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            let count = of.columns.len().max(1);
            // The lower triangle; columns ascend.
            for (k, square) in of.square.as_slice().chunks_exact(count).enumerate() {
                let first = of.columns[k] * width;
                let to = &mut normal.as_mut_slice()[first..first + width];
                for (row, value) in of.columns[k..].iter().zip(&square[k..]) {
                    to[*row] += weight * value;
                }
            }
        }
        let lengths = normal.diagonal().map(f64::sqrt);
        let shortest = SHORTEST * lengths.max();
        let scale = lengths.map(|length| if length > shortest { 1.0 / length } else { 0.0 });
        let columns = normal.as_mut_slice().chunks_exact_mut(width.max(1));
        for (k, column) in columns.enumerate() {
            for (value, of_row) in column[k..].iter_mut().zip(&scale.as_slice()[k..]) {
                *value *= of_row * scale[k];
            }
            column[k] += dependence;
        }
        Some(Self { scale, factor: CholeskyFactor::new(normal)? })
    }
}
