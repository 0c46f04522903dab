//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::error::IdentificationError;
use super::experiment::Experiment;
use super::prefilter::{GROUP, Motion, MotionGroup};
use super::selection::Selection;
use crate::dynamics::{BaseParameters, Model, RegressorColumns, Workspace};
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
    let entries = Entries::new(model, selection.columns());
    let (samples, signals) = (motion.position.nrows(), entries.places.len());
    let read = entries.along(model, motion);
    let rows = decimation.decimate_groups(samples, signals, counted, read).map_err(named)?;
    Ok(entries.matrix(&rows))
}

/// The columns of all base parameters along a motion, behind the parallel filter, at the rows that are
/// fitted.
pub(super) struct BaseColumns {
    /// Those of the selected parameters, the observation matrix X.
    pub(super) selected: DMatrix<f64>,
    pub(super) beside: BesideObservation,
}

/// What the model is checked with beside the observation matrix.
pub(super) struct BesideObservation {
    /// dX/dt.
    pub(super) rates: DMatrix<f64>,
    /// The columns of the base parameters that are not selected, which are taken as 0.
    pub(super) left_out: DMatrix<f64>,
}

impl BaseColumns {
    pub(super) fn new(
        model: &Model,
        base: &BaseParameters,
        selection: &Selection,
        motion: &Motion,
        decimation: &ParallelDecimation,
        experiment: &Experiment,
    ) -> Result<Self, IdentificationError> {
        let width = selection.columns().len();
        let left_out = base.columns().iter().filter(|column| !selection.columns().contains(column));
        let all: Vec<usize> = selection.columns().iter().chain(left_out).copied().collect();
        let entries = Entries::new(model, &all);
        let (samples, signals) = (motion.position.nrows(), entries.places.len());
        let read = entries.along(model, motion);
        let [rows, differences] = decimation
            .decimate_with_differences(samples, signals, experiment.counted(), read)
            .map_err(named)?;
        let fitted = |rows| {
            let matrix = experiment.fitted_matrix(decimation, entries.matrix(rows));
            let (selected, left_out) = matrix.columns_range_pair(..width, width..);
            [selected.into_owned(), left_out.into_owned()]
        };
        let ([selected, left_out], [differences, _]) = (fitted(&rows), fitted(&differences));
        let rates = differences * (0.5 * experiment.sample_rate_hz());
        Ok(Self { selected, beside: BesideObservation { rates, left_out } })
    }
}

/// Columns of the regressor as signals: every pair of joint and parameter, but for those that are
/// always 0.
struct Entries {
    joints: usize,
    columns: RegressorColumns,
    /// Joint and column.
    places: Vec<(usize, usize)>,
}

impl Entries {
    fn new(model: &Model, wanted: &[usize]) -> Self {
        let (joints, width) = (model.joints(), model.parameter_names().len());
        let pattern = model.regressor_pattern();
        let places = (0..joints)
            .flat_map(|joint| (0..wanted.len()).map(move |column| (joint, column)))
            .filter(|&(joint, column)| pattern[joint * width + wanted[column]]);
        Self { joints, columns: model.regressor_columns(wanted), places: places.collect() }
    }

    /// Writes the signals along a motion from a sample on.
    fn along<'a>(
        &self,
        model: &'a Model,
        motion: &'a Motion,
    ) -> impl FnMut(usize, &mut [[f64; GROUP]]) + use<'_, 'a> {
        let width = self.columns.width();
        let places: Vec<usize> =
            self.places.iter().map(|&(joint, column)| joint * width + column).collect();
        let (mut workspace, mut group) = (Workspace::new(), MotionGroup::of_joints(self.joints));
        let mut regressor = vec![Lanes::zero(); self.joints * width];
        move |first, signals| {
            let [q, dq, ddq] = group.read(motion, first);
            model.renew_regressor(&mut workspace, &self.columns, q, dq, ddq, &mut regressor);
            for (signal, &place) in signals.iter_mut().zip(&places) {
                *signal = regressor[place].0;
            }
        }
    }

    /// Rows of the signals as a matrix with the rows of each joint together.
    fn matrix(&self, signals: &DMatrix<f64>) -> DMatrix<f64> {
        let rows = signals.nrows();
        let mut matrix = DMatrix::zeros(rows * self.joints, self.columns.width());
        for (signal, &(joint, column)) in signals.column_iter().zip(&self.places) {
            matrix.view_mut((joint * rows, column), (rows, 1)).copy_from(&signal);
        }
        matrix
    }
}

fn named(error: SignalError) -> IdentificationError {
    match error {
        SignalError::NotFinite { index } => IdentificationError::Regressor { sample: index },
        cause => IdentificationError::RegressorFilter(cause),
    }
}
