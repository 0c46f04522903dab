//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::error::IdentificationError;
use super::prefilter::Motion;
use super::selection::Selection;
use crate::dynamics::{Model, Workspace};
use crate::signal::{ParallelDecimation, SignalError};

/// The filtered, decimated observation matrix X of a motion: the rows of each joint together, one
/// column per selected parameter. Equation 6 filters each column as the torque is filtered.
///
/// # Errors
/// [`IdentificationError::RegressorFilter`] when the record is too short for the filter,
/// [`IdentificationError::Regressor`] when the regressor is not finite.
///
/// # Panics
/// When model, selection and motion are not of the same robot.
pub fn observation_matrix(
    model: &Model,
    selection: &Selection,
    motion: &Motion,
    decimation: &ParallelDecimation,
    counted: Range<usize>,
) -> Result<DMatrix<f64>, IdentificationError> {
    let (samples, joints) = motion.position.shape();
    let width = model.parameter_names().len();
    let pattern = model.regressor_pattern();
    // Every pair of joint and parameter is a signal, but for those that are always 0.
    let entries: Vec<(usize, usize)> = (0..joints)
        .flat_map(|joint| (0..selection.columns().len()).map(move |parameter| (joint, parameter)))
        .filter(|&(joint, parameter)| pattern[joint * width + selection.columns()[parameter]])
        .collect();
    let columns = model.regressor_columns(selection.columns());
    let places: Vec<usize> =
        entries.iter().map(|&(joint, parameter)| joint * columns.width() + parameter).collect();

    let mut workspace = Workspace::new();
    let mut regressor = vec![0.0; joints * columns.width()];
    let signals = decimation.decimate(samples, places.len(), counted, |k, values| {
        let [q, dq, ddq] = motion.at(k);
        let (q, dq, ddq) = (&q[..joints], &dq[..joints], &ddq[..joints]);
        model.selected_regressor(&mut workspace, &columns, q, dq, ddq, &mut regressor);
        for (value, &place) in values.iter_mut().zip(&places) {
            *value = regressor[place];
        }
    });
    let signals = signals.map_err(|cause| match cause {
        SignalError::NotFinite { index } => IdentificationError::Regressor { sample: index },
        cause => IdentificationError::RegressorFilter(cause),
    })?;

    let rows = signals.nrows();
    let mut matrix = DMatrix::zeros(rows * joints, selection.columns().len());
    for (signal, &(joint, parameter)) in signals.column_iter().zip(&entries) {
        matrix.view_mut((joint * rows, parameter), (rows, 1)).copy_from(&signal);
    }
    Ok(matrix)
}
