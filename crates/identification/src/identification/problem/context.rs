//! Input of every method: the arguments of an identification, checked against each other.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::error::IdentificationError;
use super::experiment::{Experiment, Recording};
use super::method::Method;
use super::options::Options;
use super::selection::Selection;
use crate::regression::RowFilter;
use crate::signal::{Group, ParallelDecimation, SignalError, group_of};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, Robot};

/// Largest number of entries of an observation matrix without decimation, zeros included: 160 MB.
const MAX_ENTRIES: usize = 20_000_000;

/// Number of alternations between the parameters and the loads. Each one reduces the error of the
/// loads to a few hundredths, about the ratio in which friction grows with the load.
const LOAD_PASSES: usize = 8;

/// Input of every method.
#[derive(Clone)]
pub(crate) struct Context<'a> {
    pub(crate) robot: &'a Robot,
    pub(crate) base: &'a BaseParameters,
    pub(crate) experiment: &'a Experiment,
    pub(crate) options: &'a Options,
    pub(crate) model: Model,
    pub(crate) selection: Selection,
    pub(crate) decimation: ParallelDecimation,
    /// Sample of each row of a joint.
    pub(crate) samples: Vec<usize>,
    /// Indices of the fitted rows among the decimated rows; `None` if all are fitted.
    fitted_rows: Option<Vec<usize>>,
}

impl<'a> Context<'a> {
    /// Creates the context of a method. Its rows are decimated, unless the method simulates and the
    /// options disable the decimation filter.
    ///
    /// # Errors
    /// Robot, experiment and options that permit no identification.
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
            ParallelDecimation::identity()
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
        options.tolerances.validate()?;
        let selection = options.selection(robot, base)?;
        options.validate_required(&selection)?;
        let rows_kept: Vec<usize> = (experiment.recordings().iter())
            .flat_map(|Recording { samples, counted_samples: counted }| {
                let start = samples.start;
                let range = counted.start - start..counted.end - start;
                decimation.kept_samples(range).map(move |sample| start + sample)
            })
            .collect();
        let fitted = experiment.has_held_out().then(|| {
            (0..rows_kept.len())
                .filter(|&row| !experiment.is_held_out(rows_kept[row]))
                .collect::<Vec<_>>()
        });
        let samples = match &fitted {
            None => rows_kept,
            Some(fitted) => fitted.iter().map(|&row| rows_kept[row]).collect(),
        };
        let recorded = robot.recorded_torque();
        let joints = experiment.joints() - recorded.missing_joints().len();
        if joints == 0 {
            return Err(IdentificationError::NoRecordedTorque);
        }
        if method.simulates() && !recorded.missing_joints().is_empty() {
            let joints = recorded.missing_joints().to_vec();
            return Err(IdentificationError::MissingTorques { method, joints });
        }
        let (rows, parameters) = (samples.len() * joints, selection.names().len());
        if rows <= parameters {
            return Err(IdentificationError::TooFewRows { rows, parameters });
        }
        if decimation.is_none() && rows * parameters > MAX_ENTRIES {
            return Err(IdentificationError::TooManyRows { rows, parameters });
        }
        let model = Model::new(robot);
        Ok(Self {
            robot,
            base,
            experiment,
            options,
            model,
            selection,
            decimation,
            samples,
            fitted_rows: fitted,
        })
    }

    /// Returns true if the torque of a joint, counted from 0, is recorded.
    pub(crate) fn has_torque(&self, joint: usize) -> bool {
        self.robot.recorded_torque().has_joint(JointIndex::new(joint))
    }

    /// Returns true if the torques of all joints that a motor, counted from 0, acts on are
    /// recorded.
    pub(crate) fn has_motor_torque(&self, motor: usize) -> bool {
        let row = self.robot.transmission().row(motor).iter().enumerate();
        row.filter(|(_, ratio)| **ratio != 0.0).all(|(joint, _)| self.has_torque(joint))
    }

    /// Returns the context with the loads of a final estimate, which are used to judge this
    /// estimate.
    #[must_use]
    pub(crate) fn with_final_loads(&self, parameters: &DVector<f64>) -> Self {
        let mut judged = self.clone();
        judged.set_loads(parameters);
        judged
    }

    /// Sets the loads of the arm with these selected parameters, if the model's friction depends on
    /// them.
    pub(crate) fn set_loads(&mut self, parameters: &DVector<f64>) {
        if self.model.feels_loads() {
            self.model = self.with_loads(parameters);
        }
    }

    /// Sets the loads that follow from the parameters that `find` returns, if friction depends on
    /// them. Parameters and loads are determined in turn.
    ///
    /// # Errors
    /// Those of `find`.
    pub(crate) fn settle_loads<E>(
        &mut self,
        mut find: impl FnMut(&Self) -> Result<DVector<f64>, E>,
    ) -> Result<(), E> {
        if self.model.feels_loads() {
            for _ in 0..LOAD_PASSES {
                let loads = find(self)?;
                self.set_loads(&loads);
            }
        }
        Ok(())
    }

    /// Returns the model with the loads of these selected parameters.
    pub(crate) fn with_loads(&self, parameters: &DVector<f64>) -> Model {
        self.model.clone().with_load(self.selection.to_standard(parameters))
    }

    /// Decimates signals, each recording separately, and returns the fitted rows (rows × signals).
    /// `read` has the same meaning as in [`decimate_groups`](ParallelDecimation::decimate_groups),
    /// for the whole experiment.
    ///
    /// # Errors
    /// Those of `decimate_groups`.
    pub(crate) fn decimate_signals(
        &self,
        signals: usize,
        read: &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<DMatrix<f64>, SignalError> {
        let [rows] = self.decimate_each(|decimation, samples, counted, first| {
            let mut read_from_first = |at: usize, group: &mut [Group]| read(first + at, group);
            decimation
                .decimate_groups(samples, signals, counted, &mut read_from_first)
                .map(|rows| [rows])
        })?;
        Ok(rows)
    }

    /// Decimates signals that are read one sample at a time
    /// ([`decimate_signals`](ParallelDecimation::decimate_signals)).
    ///
    /// # Errors
    /// Those of `decimate_groups`.
    pub(crate) fn decimate_samples(
        &self,
        signals: usize,
        read: &mut dyn FnMut(usize, &mut [f64]),
    ) -> Result<DMatrix<f64>, SignalError> {
        let [rows] = self.decimate_each(|decimation, samples, counted, first| {
            let mut read_from_first = |at: usize, values: &mut [f64]| read(first + at, values);
            decimation
                .decimate_signals(samples, signals, counted, &mut read_from_first)
                .map(|rows| [rows])
        })?;
        Ok(rows)
    }

    /// Does the same as [`decimate_signals`](Self::decimate_signals) and also returns the
    /// differences of [`decimate_with_differences`](ParallelDecimation::decimate_with_differences).
    ///
    /// # Errors
    /// Those of `decimate_groups`.
    pub(crate) fn decimate_with_differences(
        &self,
        signals: usize,
        read: &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<[DMatrix<f64>; 2], SignalError> {
        self.decimate_each(|decimation, samples, counted, first| {
            let mut read_from_first = |at: usize, group: &mut [Group]| read(first + at, group);
            decimation.decimate_with_differences(samples, signals, counted, &mut read_from_first)
        })
    }

    /// Decimates each recording separately. `filter` receives the number of samples, the counted
    /// range and the start of the recording in the experiment.
    fn decimate_each<const N: usize>(
        &self,
        mut filter: impl FnMut(
            &ParallelDecimation,
            usize,
            Range<usize>,
            usize,
        ) -> Result<[DMatrix<f64>; N], SignalError>,
    ) -> Result<[DMatrix<f64>; N], SignalError> {
        let mut parts: Vec<[DMatrix<f64>; N]> = Vec::new();
        for Recording { samples, counted_samples: counted } in self.experiment.recordings() {
            let first = samples.start;
            let counted = counted.start - first..counted.end - first;
            let rows = filter(&self.decimation, samples.len(), counted, first);
            parts.push(rows.map_err(|error| error.later_by(first))?);
        }
        // Most experiments need no copy.
        if let [one] = parts.as_mut_slice() {
            return Ok(one.each_mut().map(core::mem::take).map(|rows| self.select_fitted(rows)));
        }
        Ok(core::array::from_fn(|which: usize| {
            let rows = parts.iter().map(|of| of[which].nrows()).sum();
            let mut stacked = DMatrix::zeros(rows, parts.first().map_or(0, |of| of[which].ncols()));
            let mut next = 0;
            for part in parts.iter().map(|of| &of[which]) {
                stacked.rows_mut(next, part.nrows()).copy_from(part);
                next += part.nrows();
            }
            self.select_fitted(stacked)
        }))
    }

    /// Returns the fitted rows among these decimated rows.
    fn select_fitted(&self, rows: DMatrix<f64>) -> DMatrix<f64> {
        match &self.fitted_rows {
            None => rows,
            Some(fitted) => rows.select_rows(fitted),
        }
    }

    /// Returns the rows of one signal per joint (samples × joints), filtered, decimated and
    /// restricted to the fitted rows, joint after joint.
    ///
    /// # Errors
    /// [`IdentificationError::Signal`] with the name `signal`.
    pub(crate) fn rows_of(
        &self,
        signals: &DMatrix<f64>,
        signal: &'static str,
    ) -> Result<DVector<f64>, IdentificationError> {
        let samples = signals.nrows();
        let mut read = |first: usize, group: &mut [Group]| {
            for (group, signal) in group.iter_mut().zip(signals.as_slice().chunks(samples)) {
                *group = group_of(signal, first);
            }
        };
        let rows = self.decimate_signals(signals.ncols(), &mut read);
        let rows = rows.map_err(|cause| {
            let joint = match cause {
                SignalError::NotFinite { index } => {
                    signals.row(index).iter().position(|value| !value.is_finite())
                }
                _ => None,
            };
            let joint = JointIndex::new(joint.unwrap_or_default());
            IdentificationError::Signal { signal, joint, cause }
        })?;
        Ok(DVector::from_column_slice(rows.as_slice()))
    }

    /// Returns the filter of a joint's rows.
    pub(crate) fn row_filter(&self) -> RowFilter {
        let passband = self.decimation.cutoff_ratio().min(1.0);
        RowFilter::new(self.samples.len(), passband, |ratio| self.decimation.noise_power(ratio))
    }

    /// Returns the rate of a joint's rows \[Hz\].
    pub(crate) fn rows_hz(&self) -> f64 {
        self.experiment.sample_rate_hz() / self.decimation.factor() as f64
    }

    /// Returns the time of each row of a joint since the first sample \[s\].
    pub(crate) fn time_s(&self) -> Vec<f64> {
        let rate_hz = self.experiment.sample_rate_hz();
        self.samples.iter().map(|&k| k as f64 / rate_hz).collect()
    }
}
