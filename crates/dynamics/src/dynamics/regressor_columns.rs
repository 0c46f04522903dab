//! Columns of the regressor to compute, and the places of their entries.

use super::drives::DriveTerms;
use crate::robot::SignModel;

/// Wanted columns of the regressor, prepared for evaluation: as a matrix, or only the entries that
/// can differ from 0.
#[derive(Clone, Debug)]
pub struct RegressorColumns {
    pub(super) width: usize,
    /// Joint and column of each value to compute, in the order of the result: a matrix row by row,
    /// entries column by column.
    pub(super) entries: Vec<(usize, usize)>,
    pub(super) is_matrix: bool,
    /// Selected parameters of each link, as an index among its ten, with the place of the first
    /// entry of each.
    pub(super) links: Vec<Vec<(usize, usize)>>,
    /// Distance between the entries of one parameter at successive joints.
    pub(super) joint_stride: usize,
    /// Terms of the drives, with their columns among the selected ones.
    pub(super) drives: DriveTerms,
    /// Position of each entry in the result, row by row.
    pub(super) entry_positions: Vec<usize>,
}

impl RegressorColumns {
    pub(super) fn new(
        first_columns: &[usize],
        drives: &DriveTerms,
        parameters: usize,
        wanted: &[usize],
        is_matrix: bool,
    ) -> Self {
        let (joints, width) = (first_columns.len(), wanted.len());
        let place = |column: usize| wanted.iter().position(|&other| other == column);
        let of_link = |&first: &usize| {
            (0..10).filter_map(|component| Some((component, place(first + component)?))).collect()
        };
        let mut links: Vec<Vec<_>> = first_columns.iter().map(of_link).collect();
        // Links beyond the last one with wanted parameters need no computation.
        while links.last().is_some_and(Vec::is_empty) {
            links.pop();
        }
        let places: Vec<_> = (0..parameters).map(place).collect();
        let drives = drives.with_columns(&places);

        // The torque of a joint depends only on the links after it and on the drives that act on
        // it.
        let mut differs = vec![false; joints * width];
        for (link, wanted) in links.iter().enumerate() {
            for (row, (_, column)) in
                (0..=link).flat_map(|row| wanted.iter().map(move |w| (row, w)))
            {
                differs[row * width + column] = true;
            }
        }
        drives.for_each_entry(|row, column| differs[row * width + column] = true);
        let entries: Vec<(usize, usize)> = if is_matrix {
            (0..joints).flat_map(|row| (0..width).map(move |column| (row, column))).collect()
        } else {
            let all_entries =
                (0..width).flat_map(|column| (0..joints).map(move |row| (row, column)));
            all_entries.filter(|(row, column)| differs[row * width + column]).collect()
        };
        let mut indices = vec![usize::MAX; joints * width];
        for (index, (row, column)) in entries.iter().enumerate() {
            indices[row * width + column] = index;
        }
        for (_, column) in links.iter_mut().flatten() {
            *column = indices[*column];
        }
        let stride = if is_matrix { width } else { 1 };
        Self {
            width,
            entries,
            is_matrix,
            links,
            joint_stride: stride,
            drives,
            entry_positions: indices,
        }
    }

    /// Returns joint and column of the entries, in the order in which they are computed.
    pub fn entries(&self) -> &[(usize, usize)] {
        &self.entries
    }

    pub(super) fn set_sign_model(&mut self, sign_model: SignModel) {
        self.drives.set_sign_model(sign_model);
    }

    pub(super) fn set_stribeck_speed(&mut self, speed_rad_s: f64) {
        self.drives.set_stribeck_speed(speed_rad_s);
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }
}
