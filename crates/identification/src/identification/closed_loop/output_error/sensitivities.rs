//! Sensitivities on the record's grid, and the rows that are computed from them.

use nalgebra::DMatrix;

use crate::identification::problem::{Context, IdentificationError};

/// Sensitivities of one output at every sample: joint after joint, parameter after parameter, one
/// column per sample. They take 8 bytes per sample, joint and parameter: 46 MB for the paper's
/// 34,500 samples of 6 joints with 28 parameters.
pub(super) struct SensitivitySignals {
    values: DMatrix<f64>,
    width: usize,
}

impl SensitivitySignals {
    pub(super) fn new(samples: usize, joints: usize, width: usize) -> Self {
        Self { values: DMatrix::zeros(joints * width, samples), width }
    }

    /// Stores the sensitivities of one sample, joints × parameters.
    pub(super) fn set(&mut self, sample: usize, values: &[f64]) {
        for (to, value) in self.values.column_mut(sample).iter_mut().zip(values) {
            *to = *value;
        }
    }

    /// Returns Ψ: the sensitivities, filtered and decimated like the signals.
    pub(super) fn rows(&self, context: &Context<'_>) -> Result<DMatrix<f64>, IdentificationError> {
        let Self { values, width } = self;
        let signals = values.nrows();
        let filtered = context
            .decimate_samples(signals, &mut |k, to| {
                to.copy_from_slice(values.column(k).as_slice());
            })
            .map_err(IdentificationError::RegressorFilter)?;
        let rows = filtered.nrows();
        let mut matrix = DMatrix::zeros(rows * (signals / width), *width);
        for (signal, column) in filtered.column_iter().enumerate() {
            let (joint, parameter) = (signal / width, signal % width);
            matrix.view_mut((joint * rows, parameter), (rows, 1)).copy_from(&column);
        }
        Ok(matrix)
    }
}
