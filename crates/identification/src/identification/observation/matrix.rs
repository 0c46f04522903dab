//! Observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::group::{MotionGroup, States};
use super::motion::Motion;
use crate::identification::problem::{Context, IdentificationError, Selection};
use crate::regression::ObservationMatrix;
use crate::signal::{Group, ParallelDecimation, SignalError};
use didim_dynamics::dynamics::{Model, RegressorColumns, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar};
use didim_dynamics::robot::Robot;

/// Returns the filtered, decimated observation matrix X of a motion: the rows of each joint
/// together, one column per selected parameter. Equation 6 filters each column like the torque.
///
/// # Errors
/// [`IdentificationError::RegressorFilter`] when the record is too short for the filter,
/// [`IdentificationError::Regressor`] when the regressor is not finite.
///
/// # Panics
/// If model, selection and motion belong to different robots.
pub fn observation_matrix(
    model: &Model,
    selection: &Selection,
    motion: &Motion,
    decimation: &ParallelDecimation,
    counted: Range<usize>,
) -> Result<DMatrix<f64>, IdentificationError> {
    let columns = model.regressor_entries(selection.columns());
    let entries = entries(model, &columns, motion, decimation, counted)?;
    Ok(matrix_of(model, &columns, entries).dense())
}

/// Returns the observation matrix of the fitted rows.
///
/// # Errors
/// Those of [`observation_matrix`].
pub(crate) fn fitted_matrix(
    context: &Context<'_>,
    motion: &Motion,
) -> Result<ObservationMatrix, IdentificationError> {
    fitted_matrix_of(context, &context.model, motion)
}

/// Returns the observation matrix of the fitted rows for a model with other loads.
///
/// # Errors
/// Those of [`observation_matrix`].
pub(crate) fn fitted_matrix_of(
    context: &Context<'_>,
    model: &Model,
    motion: &Motion,
) -> Result<ObservationMatrix, IdentificationError> {
    let columns = model.regressor_entries(context.selection.columns());
    let mut read = entries_along(model, &columns, motion);
    let entries = context
        .decimate_signals(columns.entries().len(), &mut read)
        .map_err(IdentificationError::of_regressor)?;
    let base_entries = columns.entries().iter().copied();
    let matrix =
        ObservationMatrix::of_entries(model.joints(), columns.width(), base_entries, entries);
    Ok(matrix.without_joints(unrecorded(model)))
}

/// Returns these regressor columns at the states of a motion, with the rows of each joint together
/// (states · n × columns).
///
/// # Errors
/// [`IdentificationError::Regressor`] when the regressor is not finite.
pub(crate) fn regressor_rows(
    model: &Model,
    columns: &[usize],
    states: &Motion,
) -> Result<DMatrix<f64>, IdentificationError> {
    Ok(matrix_at(model, columns, states)?.dense())
}

/// Returns the same without its zeros.
///
/// # Errors
/// Those of [`regressor_rows`].
pub(crate) fn matrix_at(
    model: &Model,
    columns: &[usize],
    states: &Motion,
) -> Result<ObservationMatrix, IdentificationError> {
    let columns = model.regressor_entries(columns);
    let (all, none) = (0..states.position.nrows(), ParallelDecimation::identity());
    let entries = entries(model, &columns, states, &none, all)?;
    Ok(matrix_of(model, &columns, entries))
}

/// Returns what gravity of 1 m/s² along each axis of the base adds to the observation matrix of the
/// fitted rows, which is linear in gravity.
///
/// # Errors
/// Those of [`observation_matrix`].
pub(crate) fn fitted_gravity_matrices(
    context: &Context<'_>,
    motion: &Motion,
) -> Result<[ObservationMatrix; 3], IdentificationError> {
    let (robot, columns) = (context.robot, context.selection.columns());
    gravity_matrices((robot, &context.model), columns, motion, |signals, read| {
        context.decimate_signals(signals, read)
    })
}

/// Returns what gravity of 1 m/s² along each axis of the base adds to these regressor columns at
/// the states of a motion.
///
/// # Errors
/// [`IdentificationError::Regressor`] when the regressor is not finite.
pub(crate) fn gravity_matrices_at(
    arm: (&Robot, &Model),
    columns: &[usize],
    states: &Motion,
) -> Result<[ObservationMatrix; 3], IdentificationError> {
    let (count, none) = (states.position.nrows(), ParallelDecimation::identity());
    gravity_matrices(arm, columns, states, |signals, read| {
        none.decimate_groups(count, signals, 0..count, read)
    })
}

fn gravity_matrices(
    (robot, model): (&Robot, &Model),
    columns: &[usize],
    motion: &Motion,
    decimate: impl FnOnce(
        usize,
        &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<DMatrix<f64>, SignalError>,
) -> Result<[ObservationMatrix; 3], IdentificationError> {
    let kind = |place: &usize| robot.parameters().parameters()[columns[*place]].kind;
    let is_heavy = |place: &usize| kind(place).is_heavy();
    let places: Vec<usize> = (0..columns.len()).filter(is_heavy).collect();
    let heavy: Vec<usize> = places.iter().map(|place| columns[*place]).collect();
    let entries = model.regressor_entries(&heavy);
    let (joints, count) = (model.joints(), entries.entries().len());
    let models = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        .map(|gravity_m_s2| model.clone().with_gravity(gravity_m_s2));
    let (mut workspace, mut group) = (Workspace::new(), MotionGroup::of_joints(joints));
    let rest = vec![Lanes::zero(); joints];
    let values = decimate(models.len() * count, &mut |first, groups| {
        let q = group.read(motion, first).q;
        for (model, to) in models.iter().zip(groups.chunks_exact_mut(count.max(1))) {
            model.selected_regressor(&mut workspace, &entries, q, &rest, &rest, to);
        }
    })
    .map_err(IdentificationError::of_regressor)?;
    Ok(core::array::from_fn(|axis| {
        let own = entries.entries().iter().map(|(joint, column)| (*joint, places[*column]));
        let values = values.columns(axis * count, count).into_owned();
        let matrix = ObservationMatrix::of_entries(joints, columns.len(), own, values);
        matrix.without_joints(unrecorded(model))
    }))
}

/// Columns of all base parameters along a motion, filtered and decimated, at the fitted rows.
pub(crate) struct BaseColumns {
    /// Columns of the selected parameters, the observation matrix X.
    pub(crate) selected: ObservationMatrix,
    pub(crate) auxiliary: AuxiliaryObservation,
}

/// Auxiliary data for checking the model, in addition to the observation matrix.
pub(crate) struct AuxiliaryObservation {
    /// Columns of the base parameters that are not selected.
    pub(crate) left_out: ObservationMatrix,
}

impl BaseColumns {
    pub(crate) fn new(context: &Context<'_>, motion: &Motion) -> Result<Self, IdentificationError> {
        let Context { model, base, selection, .. } = context;
        let width = selection.columns().len();
        let left_out = base.columns().iter().filter(|column| !selection.columns().contains(column));
        let all_columns: Vec<usize> = selection.columns().iter().chain(left_out).copied().collect();
        let columns = model.regressor_entries(&all_columns);
        let mut read = entries_along(model, &columns, motion);
        let entries = context.decimate_signals(columns.entries().len(), &mut read);
        let mut entries = entries.map_err(IdentificationError::of_regressor)?;
        // The entries are stored column by column.
        let count = columns.entries().partition_point(|(_, column)| *column < width);
        let left_out = ObservationMatrix::of_entries(
            model.joints(),
            all_columns.len() - width,
            columns.entries()[count..].iter().map(|(joint, column)| (*joint, column - width)),
            entries.columns_range(count..).into_owned(),
        );
        let left_out = left_out.without_joints(unrecorded(model));
        entries = entries.resize_horizontally(count, 0.0);
        let base_entries = columns.entries()[..count].iter().copied();
        let selected = ObservationMatrix::of_entries(model.joints(), width, base_entries, entries);
        let selected = selected.without_joints(unrecorded(model));
        Ok(Self { selected, auxiliary: AuxiliaryObservation { left_out } })
    }
}

/// Returns the entries of these columns along a motion, filtered and decimated.
fn entries(
    model: &Model,
    columns: &RegressorColumns,
    motion: &Motion,
    decimation: &ParallelDecimation,
    counted: Range<usize>,
) -> Result<DMatrix<f64>, IdentificationError> {
    let mut read = entries_along(model, columns, motion);
    let (samples, signals) = (motion.position.nrows(), columns.entries().len());
    decimation
        .decimate_groups(samples, signals, counted, &mut read)
        .map_err(IdentificationError::of_regressor)
}

/// Returns a function that writes the entries of these regressor columns for groups of samples.
fn entries_along<'a>(
    model: &'a Model,
    columns: &'a RegressorColumns,
    motion: &'a Motion,
) -> impl FnMut(usize, &mut [Group]) + use<'a> {
    let (mut workspace, mut group) = (Workspace::new(), MotionGroup::of_joints(model.joints()));
    move |first, entries| {
        let States { q, dq, ddq, hysteresis } = group.read(motion, first);
        workspace.set_hysteresis(hysteresis.copied());
        model.selected_regressor(&mut workspace, columns, q, dq, ddq, entries);
    }
}

/// Arranges the rows of the entries so that the rows of each joint are together.
fn matrix_of(
    model: &Model,
    columns: &RegressorColumns,
    entries: DMatrix<f64>,
) -> ObservationMatrix {
    let all_entries = columns.entries().iter().copied();
    let matrix =
        ObservationMatrix::of_entries(model.joints(), columns.width(), all_entries, entries);
    matrix.without_joints(unrecorded(model))
}

/// Returns the joints of a model without a recorded torque, counted from 0.
fn unrecorded(model: &Model) -> impl Iterator<Item = usize> {
    model.missing_torques().iter().map(|joint| joint.position())
}
