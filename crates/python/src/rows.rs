//! Arrays with one row per sample and one column per joint.

use numpy::ndarray::{Array2, ArrayView2, Axis};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;

use crate::errors;

/// Rows of an argument: n × joints, float64.
pub(crate) type Rows<'py> = PyReadonlyArray2<'py, f64>;

/// Returns the columns of an array, one vector per joint.
pub(crate) fn columns(rows: &Rows<'_>) -> Vec<Vec<f64>> {
    rows.as_array().axis_iter(Axis(1)).map(|column| column.to_vec()).collect()
}

/// Checks the shape of an argument. `None` stands for any number of rows.
///
/// # Errors
/// [`errors::UsageError`], which names the argument, its shape and the wanted one.
pub(crate) fn check_shape(
    name: &str,
    array: &Rows<'_>,
    wanted: (Option<usize>, usize),
) -> PyResult<()> {
    let shape = array.shape();
    let (found, (rows, joints)) = ((shape[0], shape[1]), wanted);
    if found.1 == joints && rows.is_none_or(|rows| rows == found.0) {
        return Ok(());
    }
    let rows = rows.map_or("n".to_owned(), |rows| rows.to_string());
    let (given_rows, given_joints) = found;
    Err(errors::usage(format!(
        "{name} has the shape ({given_rows}, {given_joints}); give ({rows}, {joints}): one row per \
         sample and one column per joint"
    )))
}

/// Creates an array from columns of one length.
pub(crate) fn from_columns(columns: &[Vec<f64>]) -> Array2<f64> {
    let rows = columns.first().map_or(0, Vec::len);
    Array2::from_shape_fn((rows, columns.len()), |(row, column)| columns[column][row])
}

/// Copies a row to a slice.
pub(crate) fn copy_row(rows: &ArrayView2<'_, f64>, row: usize, out: &mut [f64]) {
    out.iter_mut().zip(rows.row(row)).for_each(|(to, from)| *to = *from);
}
