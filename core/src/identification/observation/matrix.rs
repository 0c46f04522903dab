//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::group::{MotionGroup, States};
use super::motion::Motion;
use crate::dynamics::{Model, RegressorColumns, Workspace};
use crate::identification::given::{Context, IdentificationError, Selection};
use crate::regression::ObservationMatrix;
use crate::signal::{Group, ParallelDecimation};

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
    let columns = model.regressor_entries(selection.columns());
    let entries = entries(model, &columns, motion, decimation, counted)?;
    Ok(matrix_of(&columns, model.joints(), entries))
}

/// The observation matrix of the rows that are fitted.
///
/// # Errors
/// As [`observation_matrix`].
pub(crate) fn fitted_matrix(
    context: &Context<'_>,
    motion: &Motion,
) -> Result<ObservationMatrix, IdentificationError> {
    fitted_matrix_of(context, &context.model, motion)
}

/// The same of a model with other loads.
///
/// # Errors
/// As [`observation_matrix`].
pub(crate) fn fitted_matrix_of(
    context: &Context<'_>,
    model: &Model,
    motion: &Motion,
) -> Result<ObservationMatrix, IdentificationError> {
    let columns = model.regressor_entries(context.selection.columns());
    let mut read = entries_along(model, &columns, motion);
    let entries = context
        .decimate(columns.entries().len(), &mut read)
        .map_err(IdentificationError::of_regressor)?;
    let own = columns.entries().iter().copied();
    Ok(ObservationMatrix::of_entries(model.joints(), columns.width(), own, entries))
}

/// The rows of each joint together, of these columns of the regressor at the states of a motion (states · n ×
/// columns).
///
/// # Errors
/// [`IdentificationError::Regressor`] when the regressor is not finite.
pub(crate) fn regressor_rows(
    model: &Model,
    columns: &[usize],
    states: &Motion,
) -> Result<DMatrix<f64>, IdentificationError> {
    let columns = model.regressor_entries(columns);
    let (all, none) = (0..states.position.nrows(), ParallelDecimation::none());
    let entries = entries(model, &columns, states, &none, all)?;
    Ok(matrix_of(&columns, model.joints(), entries))
}

/// The columns of all base parameters along a motion, behind the parallel filter, at the rows that are
/// fitted.
pub(crate) struct BaseColumns {
    /// Those of the selected parameters, the observation matrix X.
    pub(crate) selected: ObservationMatrix,
    pub(crate) beside: BesideObservation,
}

/// What the model is checked with beside the observation matrix.
pub(crate) struct BesideObservation {
    /// The columns of the base parameters that are not selected.
    pub(crate) left_out: ObservationMatrix,
}

impl BaseColumns {
    pub(crate) fn new(context: &Context<'_>, motion: &Motion) -> Result<Self, IdentificationError> {
        let Context { model, base, selection, .. } = context;
        let width = selection.columns().len();
        let left_out = base.columns().iter().filter(|column| !selection.columns().contains(column));
        let all: Vec<usize> = selection.columns().iter().chain(left_out).copied().collect();
        let columns = model.regressor_entries(&all);
        let mut read = entries_along(model, &columns, motion);
        let entries = context.decimate(columns.entries().len(), &mut read);
        let mut entries = entries.map_err(IdentificationError::of_regressor)?;
        // They are column by column.
        let own = columns.entries().partition_point(|(_, column)| *column < width);
        let left_out = ObservationMatrix::of_entries(
            model.joints(),
            all.len() - width,
            columns.entries()[own..].iter().map(|(joint, column)| (*joint, column - width)),
            entries.columns_range(own..).into_owned(),
        );
        entries = entries.resize_horizontally(own, 0.0);
        let own = columns.entries()[..own].iter().copied();
        let selected = ObservationMatrix::of_entries(model.joints(), width, own, entries);
        Ok(Self { selected, beside: BesideObservation { left_out } })
    }
}

/// The entries of these columns along a motion, filtered and decimated.
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

/// The entries of these columns of the regressor, by lanes of samples from the first on.
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

/// The rows of each joint together, from rows of the entries.
fn matrix_of(columns: &RegressorColumns, joints: usize, entries: DMatrix<f64>) -> DMatrix<f64> {
    let own = columns.entries().iter().copied();
    ObservationMatrix::of_entries(joints, columns.width(), own, entries).dense()
}
