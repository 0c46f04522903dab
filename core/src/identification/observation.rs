//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::error::IdentificationError;
use super::experiment::Experiment;
use super::prefilter::{GROUP, Motion, MotionGroup};
use super::selection::Selection;
use crate::dynamics::{BaseParameters, Model, Workspace};
use crate::lanes::Lanes;
use crate::scalar::Scalar;
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
    columns_along(model, selection.columns(), motion, decimation, counted)
}

/// The columns of all base parameters at the rows that are fitted: of the selected, which are the
/// observation matrix, and of those that are taken as 0, which may be none.
pub(super) fn base_columns(
    model: &Model,
    base: &BaseParameters,
    selection: &Selection,
    motion: &Motion,
    decimation: &ParallelDecimation,
    experiment: &Experiment,
) -> Result<[DMatrix<f64>; 2], IdentificationError> {
    let selected = selection.columns();
    let left_out = base.columns().iter().filter(|column| !selected.contains(column));
    let all: Vec<usize> = selected.iter().chain(left_out).copied().collect();
    let matrix = columns_along(model, &all, motion, decimation, experiment.counted())?;
    let matrix = experiment.fitted_matrix(decimation, matrix);
    let (observed, left_out) = matrix.columns_range_pair(..selected.len(), selected.len()..);
    Ok([observed.into_owned(), left_out.into_owned()])
}

/// These columns of the regressor along a motion.
fn columns_along(
    model: &Model,
    wanted: &[usize],
    motion: &Motion,
    decimation: &ParallelDecimation,
    counted: Range<usize>,
) -> Result<DMatrix<f64>, IdentificationError> {
    let (samples, joints) = motion.position.shape();
    let width = model.parameter_names().len();
    let pattern = model.regressor_pattern();
    // Every pair of joint and parameter is a signal, but for those that are always 0.
    let entries: Vec<(usize, usize)> = (0..joints)
        .flat_map(|joint| (0..wanted.len()).map(move |parameter| (joint, parameter)))
        .filter(|&(joint, parameter)| pattern[joint * width + wanted[parameter]])
        .collect();
    let columns = model.regressor_columns(wanted);
    let places: Vec<usize> =
        entries.iter().map(|&(joint, parameter)| joint * columns.width() + parameter).collect();

    let (mut workspace, mut group) = (Workspace::new(), MotionGroup::of_joints(joints));
    let mut regressor = vec![Lanes::zero(); joints * columns.width()];
    let read = |first, signals: &mut [[f64; GROUP]]| {
        let [q, dq, ddq] = group.read(motion, first);
        model.renew_regressor(&mut workspace, &columns, q, dq, ddq, &mut regressor);
        for (signal, &place) in signals.iter_mut().zip(&places) {
            *signal = regressor[place].0;
        }
    };
    let signals = decimation.decimate_groups(samples, places.len(), counted, read);
    let signals = signals.map_err(|cause| match cause {
        SignalError::NotFinite { index } => IdentificationError::Regressor { sample: index },
        cause => IdentificationError::RegressorFilter(cause),
    })?;

    let rows = signals.nrows();
    let mut matrix = DMatrix::zeros(rows * joints, wanted.len());
    for (signal, &(joint, parameter)) in signals.column_iter().zip(&entries) {
        matrix.view_mut((joint * rows, parameter), (rows, 1)).copy_from(&signal);
    }
    Ok(matrix)
}
