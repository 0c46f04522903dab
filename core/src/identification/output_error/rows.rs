//! From signals on the record's grid to the rows of the equation.

use nalgebra::{DMatrix, DVector};

use crate::identification::error::IdentificationError;
use crate::identification::experiment::Experiment;
use crate::signal::ParallelDecimation;

/// Sensitivities that are filtered side by side.
const LANES: usize = 4;

/// Which samples become rows, and the filter before.
pub(super) struct Rows<'a> {
    decimation: &'a ParallelDecimation,
    kept: Vec<usize>,
    pub(super) joints: usize,
}

impl<'a> Rows<'a> {
    pub(super) fn new(experiment: &Experiment, decimation: &'a ParallelDecimation) -> Self {
        let kept = decimation.kept(experiment.counted()).collect();
        Self { decimation, kept, joints: experiment.joints() }
    }

    /// The filtered rows of signals (samples × joints), joint after joint.
    pub(super) fn of_signals(
        &self,
        signals: &DMatrix<f64>,
        signal: &'static str,
    ) -> Result<DVector<f64>, IdentificationError> {
        let mut rows = Vec::with_capacity(self.kept.len() * self.joints);
        for (joint, column) in (1..).zip(signals.column_iter()) {
            let mut values: Vec<f64> = column.iter().copied().collect();
            let failed = |cause| IdentificationError::Signal { signal, joint, cause };
            self.decimation.filter(&mut values).map_err(failed)?;
            rows.extend(self.kept.iter().filter_map(|&k| values.get(k)));
        }
        Ok(DVector::from_vec(rows))
    }

    /// Ψ, filtered as the signals are.
    pub(super) fn of_sensitivities(
        &self,
        signals: SensitivitySignals,
    ) -> Result<DMatrix<f64>, IdentificationError> {
        let SensitivitySignals { groups, width } = signals;
        let mut matrix = DMatrix::zeros(self.kept.len() * self.joints, width);
        for (group, mut values) in groups.into_iter().enumerate() {
            let failed = IdentificationError::RegressorFilter;
            self.decimation.filter_lanes(&mut values).map_err(failed)?;
            let first = group * LANES;
            for signal in first..(first + LANES).min(self.joints * width) {
                let (joint, parameter) = (signal / width, signal % width);
                for (row, &k) in self.kept.iter().enumerate() {
                    matrix[(joint * self.kept.len() + row, parameter)] = values[k][signal - first];
                }
            }
        }
        Ok(matrix)
    }
}

/// The sensitivities of one output at every sample: joint after joint, parameter after parameter,
/// some side by side. 8 bytes per sample, joint and parameter: 46 MB for the paper's 34,500 samples
/// of 6 joints with 28 parameters.
pub(super) struct SensitivitySignals {
    groups: Vec<Vec<[f64; LANES]>>,
    width: usize,
}

impl SensitivitySignals {
    pub(super) fn new(samples: usize, joints: usize, width: usize) -> Self {
        let groups = (joints * width).div_ceil(LANES);
        Self { groups: vec![vec![[0.0; LANES]; samples]; groups], width }
    }

    /// The sensitivities of one sample, joints × parameters.
    pub(super) fn set(&mut self, sample: usize, values: &[f64]) {
        for (group, values) in self.groups.iter_mut().zip(values.chunks(LANES)) {
            for (lane, value) in group[sample].iter_mut().zip(values) {
                *lane = *value;
            }
        }
    }
}
