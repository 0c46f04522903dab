//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::error::IdentificationError;
use super::prefilter::{GROUP, Motion, MotionGroup};
use super::selection::Selection;
use crate::dynamics::{Model, Workspace};
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

    let (mut workspace, mut group) = (Workspace::new(), MotionGroup::of_joints(joints));
    let mut regressor = vec![Lanes::zero(); joints * columns.width()];
    let read = |first, signals: &mut [[f64; GROUP]]| {
        let [q, dq, ddq] = group.read(motion, first);
        model.selected_regressor(&mut workspace, &columns, q, dq, ddq, &mut regressor);
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
    let mut matrix = DMatrix::zeros(rows * joints, selection.columns().len());
    for (signal, &(joint, parameter)) in signals.column_iter().zip(&entries) {
        matrix.view_mut((joint * rows, parameter), (rows, 1)).copy_from(&signal);
    }
    Ok(matrix)
}
