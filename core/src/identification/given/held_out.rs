//! Samples that do not enter the fit, so that it can be judged by them.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::identification::given::experiment::{Experiment, ExperimentError};
use crate::signal::ParallelDecimation;

impl Experiment {
    /// Holds samples out: they pass the filters as the others do, and their rows enter no equation,
    /// of whatever method. The filters reach over some ten rows, so `samples` should have so many
    /// more at either end than what is to be predicted.
    ///
    /// The rows before and after are taken for neighbours where residuals are judged: at one place per
    /// range, a few products of an autocorrelation are of rows that are far apart.
    ///
    /// # Errors
    /// [`ExperimentError::Counted`] when they are not in the record.
    pub fn with_held_out(mut self, samples: Range<usize>) -> Result<Self, ExperimentError> {
        if samples.is_empty() || samples.end > self.samples() {
            return Err(ExperimentError::Counted { counted: samples, samples: self.samples() });
        }
        self.held_out.push(samples);
        Ok(self)
    }

    /// The samples of the rows that are fitted.
    pub(crate) fn fitted_samples(&self, decimation: &ParallelDecimation) -> Vec<usize> {
        decimation.kept(self.counted()).filter(|&k| !self.is_held_out(k)).collect()
    }

    /// Of signals at the rows of one joint (rows × m), the rows that are fitted.
    pub(crate) fn fitted(
        &self,
        decimation: &ParallelDecimation,
        rows: DMatrix<f64>,
    ) -> DMatrix<f64> {
        if self.held_out.is_empty() {
            return rows;
        }
        let kept = decimation.kept(self.counted()).enumerate();
        let fitted: Vec<usize> =
            kept.filter(|&(_, k)| !self.is_held_out(k)).map(|(row, _)| row).collect();
        rows.select_rows(&fitted)
    }

    /// The same of signals that are joints, their rows one joint after the other.
    pub(crate) fn fitted_joints(
        &self,
        decimation: &ParallelDecimation,
        rows: DMatrix<f64>,
    ) -> DVector<f64> {
        DVector::from_column_slice(self.fitted(decimation, rows).as_slice())
    }

    /// The same of an observation matrix, which has the rows of each joint together.
    pub(crate) fn fitted_matrix(
        &self,
        decimation: &ParallelDecimation,
        matrix: DMatrix<f64>,
    ) -> DMatrix<f64> {
        if self.held_out.is_empty() {
            return matrix;
        }
        let rows = matrix.nrows() / self.joints();
        let kept: Vec<usize> = decimation.kept(self.counted()).collect();
        let joints = (0..self.joints()).flat_map(|joint| {
            let fitted = kept.iter().enumerate().filter(|(_, k)| !self.is_held_out(**k));
            fitted.map(move |(row, _)| joint * rows + row)
        });
        matrix.select_rows(&joints.collect::<Vec<_>>())
    }

    fn is_held_out(&self, sample: usize) -> bool {
        self.held_out.iter().any(|range| range.contains(&sample))
    }
}
