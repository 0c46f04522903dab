//! The observation matrix of equation 7 without the zeros that joints leave in its columns.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::products::symmetric_product;

/// Rows that are multiplied at a time, which bounds the memory.
pub(crate) const ROWS_AT_ONCE: usize = 4096;

/// X (r × b) with the rows of joint 1 first, then joint 2, …: of each joint only those columns that act on it, which
/// is about half of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservationMatrix {
    columns: usize,
    /// N rows of every joint; a column for each joint and each column of X that acts on it.
    values: DMatrix<f64>,
    joints: Vec<Vec<Entry>>,
}

/// A column of X in the rows of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    column: usize,
    /// Where its values are.
    at: usize,
}

impl ObservationMatrix {
    /// Of so many joints and columns: `values` (N × entries) has in each column what the joint and the column of X have that
    /// `entries` names. What is not named is 0.
    ///
    /// # Panics
    /// When an entry is of no such joint.
    pub fn of_entries(
        joints: usize,
        columns: usize,
        entries: impl IntoIterator<Item = (usize, usize)>,
        values: DMatrix<f64>,
    ) -> Self {
        let mut of_joints = vec![Vec::new(); joints];
        for (at, (joint, column)) in entries.into_iter().enumerate() {
            of_joints[joint].push(Entry { column, at });
        }
        for entries in &mut of_joints {
            entries.sort_by_key(|entry| entry.column);
        }
        Self { columns, values, joints: of_joints }
    }

    /// From a matrix with its zeros, whose rows are a multiple of the joints.
    pub fn of(matrix: DMatrix<f64>, joints: usize) -> Self {
        let (rows, columns) = matrix.shape();
        let per_joint = rows / joints.max(1);
        // The same memory, with the joints of a column as columns of their own.
        let values = DMatrix::from_vec(per_joint, joints * columns, matrix.data.into());
        let acts = |entry: &Entry| values.column(entry.at).iter().any(|value| *value != 0.0);
        let of_joint = |joint: usize| {
            let all = (0..columns).map(|column| Entry { column, at: column * joints + joint });
            all.filter(acts).collect()
        };
        let of_joints = (0..joints).map(of_joint).collect();
        Self { columns, values, joints: of_joints }
    }

    /// With its zeros (r × b).
    pub fn dense(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.nrows(), self.columns);
        for joint in 0..self.joints.len() {
            let first = joint * self.rows_per_joint();
            for (column, values) in self.of_joint(joint) {
                dense.column_mut(column).as_mut_slice()[first..][..values.len()]
                    .copy_from_slice(values);
            }
        }
        dense
    }

    /// Rows r of all joints.
    pub fn nrows(&self) -> usize {
        self.rows_per_joint() * self.joints.len()
    }

    /// Columns b.
    pub fn ncols(&self) -> usize {
        self.columns
    }

    /// Joints n.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// r and b.
    pub fn shape(&self) -> (usize, usize) {
        (self.nrows(), self.columns)
    }

    /// Rows N of each joint.
    pub fn rows_per_joint(&self) -> usize {
        self.values.nrows()
    }

    /// The columns that act on a joint, ascending, each with its values in the joint's rows (N).
    pub fn of_joint(&self, joint: usize) -> impl Iterator<Item = (usize, &[f64])> + Clone {
        let values = |at: usize| {
            let rows = self.values.nrows();
            &self.values.as_slice()[at * rows..(at + 1) * rows]
        };
        self.joints[joint].iter().map(move |entry| (entry.column, values(entry.at)))
    }

    /// Whether a column acts on a joint.
    pub(crate) fn acts_on(&self, joint: usize, column: usize) -> bool {
        self.joints[joint].iter().any(|entry| entry.column == column)
    }

    /// A column in the rows of a joint (N), where it acts on it.
    pub(crate) fn column_of(&self, joint: usize, column: usize) -> Option<&[f64]> {
        self.of_joint(joint).find(|(own, _)| *own == column).map(|(_, values)| values)
    }

    /// Which columns act on a joint, ascending.
    pub(crate) fn columns_of(&self, joint: usize) -> Vec<usize> {
        self.joints[joint].iter().map(|entry| entry.column).collect()
    }

    /// X θ (r).
    pub fn times(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(self.nrows());
        self.add_times(1.0, parameters, product.as_mut_slice());
        product
    }

    /// Adds a factor times X θ.
    pub(super) fn add_times(&self, factor: f64, parameters: &DVector<f64>, to: &mut [f64]) {
        for (joint, to) in to.chunks_exact_mut(self.rows_per_joint().max(1)).enumerate() {
            self.add_joint_times(joint, factor, parameters, to);
        }
    }

    /// Adds a factor times X_j θ to the rows of one joint (N).
    pub(super) fn add_joint_times(
        &self,
        joint: usize,
        factor: f64,
        parameters: &DVector<f64>,
        to: &mut [f64],
    ) {
        for (column, values) in self.of_joint(joint) {
            let share = factor * parameters[column];
            for (to, value) in to.iter_mut().zip(values) {
                *to += share * value;
            }
        }
    }

    /// Adds a factor times Xᵀ times values in the rows of one joint (N).
    pub(crate) fn add_transposed_times(
        &self,
        joint: usize,
        factor: f64,
        rows: &[f64],
        to: &mut DVector<f64>,
    ) {
        for (column, values) in self.of_joint(joint) {
            to[column] += factor * super::products::dot_of(values, rows);
        }
    }

    /// Some rows of a joint, of the columns that act on it.
    pub(crate) fn rows_of(&self, joint: usize, rows: Range<usize>) -> DMatrix<f64> {
        let mut block = DMatrix::zeros(rows.len(), self.joints[joint].len());
        for ((_, values), mut to) in self.of_joint(joint).zip(block.column_iter_mut()) {
            to.copy_from_slice(&values[rows.clone()]);
        }
        block
    }

    /// The same of rows that are not together.
    pub(crate) fn selected_rows_of(&self, joint: usize, rows: &[usize]) -> DMatrix<f64> {
        let mut block = DMatrix::zeros(rows.len(), self.joints[joint].len());
        for ((_, values), mut to) in self.of_joint(joint).zip(block.column_iter_mut()) {
            to.iter_mut().zip(rows).for_each(|(to, row)| *to = values[*row]);
        }
        block
    }

    /// `X_jᵀX_j` of the columns that act on a joint.
    pub(crate) fn gram(&self, joint: usize) -> DMatrix<f64> {
        let (rows, columns) = (self.rows_per_joint(), self.joints[joint].len());
        let mut gram = DMatrix::zeros(columns, columns);
        for first in (0..rows).step_by(ROWS_AT_ONCE) {
            let block = self.rows_of(joint, first..rows.min(first + ROWS_AT_ONCE));
            gram += symmetric_product(&block, &block);
        }
        gram
    }

    /// Makes a row of a joint 0.
    pub(crate) fn silence(&mut self, joint: usize, row: usize) {
        for entry in &self.joints[joint] {
            self.values[(row, entry.at)] = 0.0;
        }
    }

    /// The first row in which something is not finite.
    pub(super) fn bad_row(&self) -> Option<(usize, usize)> {
        let bad = |joint: usize| {
            let of = self.of_joint(joint);
            let rows = of.filter_map(|(_, values)| values.iter().position(|v| !v.is_finite()));
            Some((joint, rows.min()?))
        };
        (0..self.joints.len()).find_map(bad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_matrix_with_its_zeros() {
        let (joints, rows, columns) = (3, 5001, 4);
        let dense = DMatrix::from_fn(joints * rows, columns, |row, column| {
            let acts = column >= row / rows;
            if acts { ((row * 37 + column * 11) % 23) as f64 - 9.0 } else { 0.0 }
        });
        let matrix = ObservationMatrix::of(dense.clone(), joints);
        assert_eq!(matrix.dense(), dense);
        assert_eq!((matrix.shape(), matrix.columns_of(2)), (dense.shape(), vec![2, 3]));
        let parameters = DVector::from_fn(columns, |k, _| k as f64 - 1.5);
        assert_eq!(matrix.times(&parameters), &dense * &parameters);
        let own = dense.view((2 * rows, 2), (rows, 2));
        assert_eq!(matrix.gram(2), own.tr_mul(&own));
        let values: Vec<f64> = (0..rows).map(|k| (k % 7) as f64).collect();
        let mut found = DVector::zeros(columns);
        matrix.add_transposed_times(2, 2.0, &values, &mut found);
        let expected = own.tr_mul(&DVector::from_vec(values)) * 2.0;
        assert_eq!(found.as_slice(), [0.0, 0.0, expected[0], expected[1]]);
        assert_eq!(matrix.selected_rows_of(2, &[7, 4]).row(0), own.row(7));
        let mut silenced = matrix.clone();
        silenced.silence(1, 3);
        assert!(silenced.dense().row(rows + 3).iter().all(|value| *value == 0.0));
    }
}
