//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::group::MotionGroup;
use super::known::known_rates;
use super::motion::Motion;
use crate::dynamics::{Model, RegressorColumns, Workspace};
use crate::identification::given::{Context, IdentificationError, Selection};
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
    Ok(matrix_of(&columns, 0..columns.width(), model.joints(), &entries))
}

/// The observation matrix of the rows that are fitted.
///
/// # Errors
/// As [`observation_matrix`].
pub(crate) fn fitted_matrix(
    context: &Context<'_>,
    motion: &Motion,
) -> Result<DMatrix<f64>, IdentificationError> {
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
) -> Result<DMatrix<f64>, IdentificationError> {
    let columns = model.regressor_entries(context.selection.columns());
    let mut read = entries_along(model, &columns, motion);
    let entries = context
        .decimate(columns.entries().len(), &mut read)
        .map_err(IdentificationError::of_regressor)?;
    Ok(matrix_of(&columns, 0..columns.width(), model.joints(), &entries))
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
    Ok(matrix_of(&columns, 0..columns.width(), model.joints(), &entries))
}

/// The columns of all base parameters along a motion, behind the parallel filter, at the rows that are
/// fitted.
pub(crate) struct BaseColumns {
    /// Those of the selected parameters, the observation matrix X.
    pub(crate) selected: DMatrix<f64>,
    pub(crate) beside: BesideObservation,
}

/// What the model is checked with beside the observation matrix.
pub(crate) struct BesideObservation {
    /// dX/dt.
    rates: DMatrix<f64>,
    /// What is known of the torque beside the parameters, its rate of change; none where nothing is.
    known_rates: Option<DVector<f64>>,
    /// The columns of the base parameters that are not selected.
    pub(crate) left_out: DMatrix<f64>,
}

impl BesideObservation {
    /// How the predicted torque of these parameters changes \[N·m/s or N/s\].
    pub(crate) fn torque_rates(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let rates = &self.rates * parameters;
        match &self.known_rates {
            None => rates,
            Some(known) => rates + known,
        }
    }
}

impl BaseColumns {
    pub(crate) fn new(context: &Context<'_>, motion: &Motion) -> Result<Self, IdentificationError> {
        let Context { model, base, selection, experiment, .. } = context;
        let width = selection.columns().len();
        let left_out = base.columns().iter().filter(|column| !selection.columns().contains(column));
        let all: Vec<usize> = selection.columns().iter().chain(left_out).copied().collect();
        let columns = model.regressor_entries(&all);
        let joints = motion.position.ncols();
        let mut read = entries_along(model, &columns, motion);
        let filtered = context.decimate_with_differences(columns.entries().len(), &mut read);
        let [entries, differences] = filtered.map_err(IdentificationError::of_regressor)?;
        let selected = matrix_of(&columns, 0..width, joints, &entries);
        let left_out = matrix_of(&columns, width..all.len(), joints, &entries);
        let differences = matrix_of(&columns, 0..width, joints, &differences);
        let rates = differences * (0.5 * experiment.sample_rate_hz());
        let known_rates = known_rates(context, motion)?;
        Ok(Self { selected, beside: BesideObservation { rates, known_rates, left_out } })
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
        let [q, dq, ddq] = group.read(motion, first);
        model.selected_regressor(&mut workspace, columns, q, dq, ddq, entries);
    }
}

/// Some of the columns from rows of their entries: the rows of each joint together.
fn matrix_of(
    columns: &RegressorColumns,
    wanted: Range<usize>,
    joints: usize,
    entries: &DMatrix<f64>,
) -> DMatrix<f64> {
    let rows = entries.nrows();
    let mut matrix = DMatrix::zeros(rows * joints, wanted.len());
    for (entry, &(joint, column)) in entries.column_iter().zip(columns.entries()) {
        if wanted.contains(&column) {
            let mut own = matrix.view_mut((joint * rows, column - wanted.start), (rows, 1));
            own.copy_from(&entry);
        }
    }
    matrix
}
