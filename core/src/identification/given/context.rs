//! What every method works with: the arguments of an identification, found to fit each other.

use nalgebra::{DMatrix, DVector};

use super::error::IdentificationError;
use super::experiment::Experiment;
use super::method::Method;
use super::options::Options;
use super::selection::Selection;
use crate::dynamics::{BaseParameters, Model};
use crate::regression::RowFilter;
use crate::robot::Robot;
use crate::signal::{ParallelDecimation, SignalError};

/// Entries of an observation matrix without decimation: 160 MB, and up to twelve times as much while
/// the model is checked, which looks at every column's spectrum.
const MOST_ENTRIES: usize = 20_000_000;

/// What every method works with.
pub(crate) struct Context<'a> {
    pub(crate) robot: &'a Robot,
    pub(crate) base: &'a BaseParameters,
    pub(crate) experiment: &'a Experiment,
    pub(crate) options: &'a Options,
    pub(crate) model: Model,
    pub(crate) selection: Selection,
    pub(crate) decimation: ParallelDecimation,
    /// The sample of each row of a joint.
    pub(crate) samples: Vec<usize>,
    /// Which of the rows that the decimation leaves these are, where it is not all.
    fitted: Option<Vec<usize>>,
}

impl<'a> Context<'a> {
    /// For a method, whose rows are behind the decimation filter unless it simulates and shall do without.
    ///
    /// # Errors
    /// What makes robot, experiment and options no identification.
    pub(crate) fn new(
        robot: &'a Robot,
        base: &'a BaseParameters,
        experiment: &'a Experiment,
        options: &'a Options,
        method: Method,
    ) -> Result<Self, IdentificationError> {
        if method.simulates() {
            options.simulation.validate()?;
        }
        let decimated = options.simulation.decimated || !method.simulates();
        let decimation = if decimated {
            options.decimation_filter.design().map_err(IdentificationError::DecimationFilter)?
        } else {
            ParallelDecimation::none()
        };
        options.validate_robust(method)?;
        if robot.joints() != experiment.joints() {
            return Err(IdentificationError::JointCount {
                robot: robot.name().to_owned(),
                joints: robot.joints(),
                experiment: experiment.joints(),
            });
        }
        options.limits.validate()?;
        let selection = Selection::new(robot, base, options.parameters.as_deref())?;
        let kept: Vec<usize> = decimation.kept(experiment.counted()).collect();
        let fitted = experiment.has_held_out().then(|| {
            (0..kept.len()).filter(|&row| !experiment.is_held_out(kept[row])).collect::<Vec<_>>()
        });
        let samples = match &fitted {
            None => kept,
            Some(fitted) => fitted.iter().map(|&row| kept[row]).collect(),
        };
        let (rows, parameters) = (samples.len() * experiment.joints(), selection.names().len());
        if rows <= parameters {
            return Err(IdentificationError::TooFewRows { rows, parameters });
        }
        if decimation.is_none() && rows * parameters > MOST_ENTRIES {
            return Err(IdentificationError::TooManyRows { rows, parameters });
        }
        let model = Model::new(robot);
        Ok(Self { robot, base, experiment, options, model, selection, decimation, samples, fitted })
    }

    /// Of signals behind the decimation filter, the rows that are fitted.
    pub(crate) fn fitted(&self, rows: DMatrix<f64>) -> DMatrix<f64> {
        match &self.fitted {
            None => rows,
            Some(fitted) => rows.select_rows(fitted),
        }
    }

    /// The rows of one signal per joint (samples × joints), filtered, decimated and fitted, joint after
    /// joint.
    ///
    /// # Errors
    /// [`IdentificationError::Signal`] with this name.
    pub(crate) fn rows_of(
        &self,
        signals: &DMatrix<f64>,
        signal: &'static str,
    ) -> Result<DVector<f64>, IdentificationError> {
        let rows = self.decimation.decimate_columns(signals, self.experiment.counted());
        let rows = rows.map_err(|cause| {
            let joint = match cause {
                SignalError::NotFinite { index } => {
                    signals.row(index).iter().position(|value| !value.is_finite())
                }
                _ => None,
            };
            let joint = joint.unwrap_or_default() + 1;
            IdentificationError::Signal { signal, joint, cause }
        })?;
        Ok(DVector::from_column_slice(self.fitted(rows).as_slice()))
    }

    /// What the rows of a joint have passed.
    pub(crate) fn row_filter(&self) -> RowFilter {
        let passband = self.decimation.cutoff_ratio().min(1.0);
        RowFilter::new(self.samples.len(), passband, |ratio| self.decimation.noise_power(ratio))
    }

    /// Time of each row of a joint since the first sample \[s\].
    pub(crate) fn time_s(&self) -> Vec<f64> {
        let rate_hz = self.experiment.sample_rate_hz();
        self.samples.iter().map(|&k| k as f64 / rate_hz).collect()
    }
}
