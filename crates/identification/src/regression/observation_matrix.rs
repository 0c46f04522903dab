//! Observation matrix of equation 7, stored without the zeros of columns that do not act on a
//! joint.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::products::symmetric_product;

/// Number of rows that are multiplied at a time, which limits the memory.
pub(crate) const ROWS_AT_ONCE: usize = 4096;

/// Matrix X (r × b) with the rows of joint 1 first, then joint 2, …. For each joint only the
/// columns that act on it are stored, about half of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservationMatrix {
    columns: usize,
    /// Values (N × entries): one column for each pair of a joint and a column of X that acts on it.
    values: DMatrix<f64>,
    joints: Vec<Vec<Entry>>,
    /// Joints without an equation, ascending.
    left_out_joints: Vec<usize>,
}

/// A column of X in the rows of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    column: usize,
    /// Position of the entry's column in `values`.
    position: usize,
}

impl ObservationMatrix {
    /// Creates a matrix of this number of joints and columns. Each column of `values` (N × entries)
    /// holds the values of the joint and the column of X that `entries` names. All other values are
    /// 0.
    ///
    /// # Panics
    /// If an entry names a joint that does not exist.
    pub fn of_entries(
        joints: usize,
        columns: usize,
        entries: impl IntoIterator<Item = (usize, usize)>,
        values: DMatrix<f64>,
    ) -> Self {
        let mut of_joints = vec![Vec::new(); joints];
        for (at, (joint, column)) in entries.into_iter().enumerate() {
            of_joints[joint].push(Entry { column, position: at });
        }
        for entries in &mut of_joints {
            entries.sort_by_key(|entry| entry.column);
        }
        Self { columns, values, joints: of_joints, left_out_joints: Vec::new() }
    }

    /// Creates the matrix from a dense one, whose number of rows is a multiple of the number of
    /// joints.
    pub fn from_dense(matrix: DMatrix<f64>, joints: usize) -> Self {
        let (rows, columns) = matrix.shape();
        let per_joint = rows / joints.max(1);
        // The same memory, with the joints of a column as separate columns.
        let values = DMatrix::from_vec(per_joint, joints * columns, matrix.data.into());
        let acts = |entry: &Entry| values.column(entry.position).iter().any(|value| *value != 0.0);
        let of_joints = (0..joints)
            .map(|joint: usize| {
                let candidates =
                    (0..columns).map(|column| Entry { column, position: column * joints + joint });
                candidates.filter(acts).collect()
            })
            .collect();
        Self { columns, values, joints: of_joints, left_out_joints: Vec::new() }
    }

    /// Returns the matrix without the equations of these joints, counted from 0. Their rows stay,
    /// so that every joint has the same number of rows, and are 0.
    #[must_use]
    pub fn without_joints(mut self, joints: impl IntoIterator<Item = usize>) -> Self {
        for joint in joints {
            self.joints[joint].clear();
            self.left_out_joints.push(joint);
        }
        self.left_out_joints.sort_unstable();
        self.left_out_joints.dedup();
        self
    }

    /// Returns the joints without an equation, ascending.
    pub fn left_out_joints(&self) -> &[usize] {
        &self.left_out_joints
    }

    /// Returns true if a joint has an equation.
    pub fn has_equation(&self, joint: usize) -> bool {
        !self.left_out_joints.contains(&joint)
    }

    /// Returns the number of joints with an equation.
    pub fn joints_with_equation(&self) -> usize {
        self.joints.len() - self.left_out_joints.len()
    }

    /// Returns the number of rows that belong to an equation.
    pub fn equation_rows(&self) -> usize {
        self.rows_per_joint() * self.joints_with_equation()
    }

    /// Returns the dense matrix, including its zeros (r × b).
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

    /// Returns the number of rows r of all joints.
    pub fn nrows(&self) -> usize {
        self.rows_per_joint() * self.joints.len()
    }

    /// Returns the number of columns b.
    pub fn ncols(&self) -> usize {
        self.columns
    }

    /// Returns the number of joints n.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// Returns the numbers of rows r and columns b.
    pub fn shape(&self) -> (usize, usize) {
        (self.nrows(), self.columns)
    }

    /// Returns the number of rows N of each joint.
    pub fn rows_per_joint(&self) -> usize {
        self.values.nrows()
    }

    /// Returns the columns that act on a joint, ascending, each with its values in the joint's rows
    /// (N).
    pub fn of_joint(&self, joint: usize) -> impl Iterator<Item = (usize, &[f64])> + Clone {
        let values = |at: usize| {
            let rows = self.values.nrows();
            &self.values.as_slice()[at * rows..(at + 1) * rows]
        };
        self.joints[joint].iter().map(move |entry| (entry.column, values(entry.position)))
    }

    /// Returns true if a column acts on a joint.
    pub(crate) fn acts_on(&self, joint: usize, column: usize) -> bool {
        self.joints[joint].iter().any(|entry| entry.column == column)
    }

    /// Returns a column in the rows of a joint (N), if it acts on the joint.
    pub(crate) fn column_of(&self, joint: usize, column: usize) -> Option<&[f64]> {
        self.of_joint(joint).find(|(own, _)| *own == column).map(|(_, values)| values)
    }

    /// Returns the columns that act on a joint, ascending.
    pub(crate) fn columns_of(&self, joint: usize) -> Vec<usize> {
        self.joints[joint].iter().map(|entry| entry.column).collect()
    }

    /// Returns X θ (r).
    pub fn times_parameters(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(self.nrows());
        self.add_times(1.0, parameters, product.as_mut_slice());
        product
    }

    /// Adds `factor` · X θ to `to`.
    pub(super) fn add_times(&self, factor: f64, parameters: &DVector<f64>, to: &mut [f64]) {
        for (joint, to) in to.chunks_exact_mut(self.rows_per_joint().max(1)).enumerate() {
            self.add_joint_times(joint, factor, parameters, to);
        }
    }

    /// Adds `factor` · X_j θ to the rows of one joint (N).
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

    /// Adds `factor` · X_jᵀ v for values v in the rows of one joint (N).
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

    /// Returns some rows of a joint, in the columns that act on it.
    pub(crate) fn rows_of(&self, joint: usize, rows: Range<usize>) -> DMatrix<f64> {
        let mut block = DMatrix::zeros(rows.len(), self.joints[joint].len());
        for ((_, values), mut to) in self.of_joint(joint).zip(block.column_iter_mut()) {
            to.copy_from_slice(&values[rows.clone()]);
        }
        block
    }

    /// Returns some rows of a joint that need not be contiguous, in the columns that act on it.
    pub(crate) fn selected_rows_of(&self, joint: usize, rows: &[usize]) -> DMatrix<f64> {
        let mut block = DMatrix::zeros(rows.len(), self.joints[joint].len());
        for ((_, values), mut to) in self.of_joint(joint).zip(block.column_iter_mut()) {
            to.iter_mut().zip(rows).for_each(|(to, row)| *to = values[*row]);
        }
        block
    }

    /// Returns `X_jᵀX_j` of the columns that act on a joint.
    pub(crate) fn gram_matrix(&self, joint: usize) -> DMatrix<f64> {
        let (rows, columns) = (self.rows_per_joint(), self.joints[joint].len());
        let mut gram = DMatrix::zeros(columns, columns);
        for first in (0..rows).step_by(ROWS_AT_ONCE) {
            let block = self.rows_of(joint, first..rows.min(first + ROWS_AT_ONCE));
            gram += symmetric_product(&block, &block);
        }
        gram
    }

    /// Adds `factor` times another matrix, whose entries this one has too.
    pub(crate) fn add_scaled(&mut self, factor: f64, other: &Self) {
        for (joint, entries) in self.joints.iter().enumerate() {
            for (column, added) in other.of_joint(joint) {
                let Ok(at) = entries.binary_search_by_key(&column, |own| own.column) else {
                    continue;
                };
                let mut own = self.values.column_mut(entries[at].position);
                own.iter_mut().zip(added).for_each(|(to, value)| *to += factor * value);
            }
        }
    }

    /// Sets a row of a joint to 0.
    pub(crate) fn zero_row(&mut self, joint: usize, row: usize) {
        for entry in &self.joints[joint] {
            self.values[(row, entry.position)] = 0.0;
        }
    }

    /// Returns the first row with an entry that is not finite.
    pub(super) fn bad_row(&self) -> Option<(usize, usize)> {
        (0..self.joints.len()).find_map(|joint: usize| {
            let blocks = self.of_joint(joint);
            let rows = blocks.filter_map(|(_, values)| values.iter().position(|v| !v.is_finite()));
            Some((joint, rows.min()?))
        })
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
        let matrix = ObservationMatrix::from_dense(dense.clone(), joints);
        assert_eq!(matrix.dense(), dense);
        assert_eq!((matrix.shape(), matrix.columns_of(2)), (dense.shape(), vec![2, 3]));
        let acting = (0..columns).filter(|column| matrix.acts_on(2, *column));
        assert_eq!(acting.collect::<Vec<_>>(), [2, 3]);
        let parameters = DVector::from_fn(columns, |k, _| k as f64 - 1.5);
        assert_eq!(matrix.times_parameters(&parameters), &dense * &parameters);
        let block = dense.view((2 * rows, 2), (rows, 2));
        assert_eq!(matrix.gram_matrix(2), block.tr_mul(&block));
        let values: Vec<f64> = (0..rows).map(|k| (k % 7) as f64).collect();
        let mut product = DVector::zeros(columns);
        matrix.add_transposed_times(2, 2.0, &values, &mut product);
        let expected = block.tr_mul(&DVector::from_vec(values)) * 2.0;
        assert_eq!(product.as_slice(), [0.0, 0.0, expected[0], expected[1]]);
        assert_eq!(matrix.selected_rows_of(2, &[7, 4]).row(0), block.row(7));
        let mut silenced = matrix.clone();
        silenced.zero_row(1, 3);
        assert!(silenced.dense().row(rows + 3).iter().all(|value| *value == 0.0));
    }
}
