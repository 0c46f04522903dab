//! From signals on the record's grid to the rows of the equation.

use nalgebra::{DMatrix, DVector};

use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::signal::{ParallelDecimation, SignalError};

/// Which samples become rows, and the filter before.
pub(super) struct Rows<'a> {
    decimation: &'a ParallelDecimation,
    experiment: &'a Experiment,
    kept: Vec<usize>,
    pub(super) joints: usize,
}

impl<'a> Rows<'a> {
    pub(super) fn new(experiment: &'a Experiment, decimation: &'a ParallelDecimation) -> Self {
        let kept = experiment.fitted_samples(decimation);
        Self { decimation, experiment, kept, joints: experiment.joints() }
    }

    /// The filtered rows of signals (samples × joints), joint after joint.
    pub(super) fn of_signals(
        &self,
        signals: &DMatrix<f64>,
        signal: &'static str,
    ) -> Result<DVector<f64>, IdentificationError> {
        let rows = self.decimation.decimate_columns(signals, self.experiment.counted());
        let rows = rows.map_err(|cause| {
            let joint = match cause {
                SignalError::NotFinite { index } => signals
                    .row(index)
                    .iter()
                    .position(|value| !value.is_finite())
                    .unwrap_or_default(),
                _ => 0,
            };
            IdentificationError::Signal { signal, joint: joint + 1, cause }
        })?;
        Ok(self.experiment.fitted_joints(self.decimation, rows))
    }

    /// Ψ, filtered as the signals are.
    pub(super) fn of_sensitivities(
        &self,
        signals: &SensitivitySignals,
    ) -> Result<DMatrix<f64>, IdentificationError> {
        let SensitivitySignals { values, width } = signals;
        let (rows, samples) = (self.kept.len(), values.ncols());
        let filtered = self
            .decimation
            .decimate(samples, values.nrows(), self.experiment.counted(), |k, to| {
                to.copy_from_slice(values.column(k).as_slice());
            })
            .map_err(IdentificationError::RegressorFilter)?;
        let filtered = self.experiment.fitted(self.decimation, filtered);
        let mut matrix = DMatrix::zeros(rows * self.joints, *width);
        for (signal, column) in filtered.column_iter().enumerate() {
            let (joint, parameter) = (signal / width, signal % width);
            matrix.view_mut((joint * rows, parameter), (rows, 1)).copy_from(&column);
        }
        Ok(matrix)
    }
}

/// The sensitivities of one output at every sample: joint after joint, parameter after parameter, a
/// column per sample. 8 bytes per sample, joint and parameter: 46 MB for the paper's 34,500 samples
/// of 6 joints with 28 parameters.
pub(super) struct SensitivitySignals {
    values: DMatrix<f64>,
    width: usize,
}

impl SensitivitySignals {
    pub(super) fn new(samples: usize, joints: usize, width: usize) -> Self {
        Self { values: DMatrix::zeros(joints * width, samples), width }
    }

    /// The sensitivities of one sample, joints × parameters.
    pub(super) fn set(&mut self, sample: usize, values: &[f64]) {
        for (to, value) in self.values.column_mut(sample).iter_mut().zip(values) {
            *to = *value;
        }
    }
}
