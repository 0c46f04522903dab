//! Parallel decimation: one filter for every column and for the torque, then every n-th sample
//! (paper, equation 6).

use core::ops::Range;

use nalgebra::{DMatrix, RowDVector};

use super::design::chebyshev1_low_pass;
use super::error::SignalError;
use super::jump::Jump;
use super::record::{Record, check_finite};
use super::sections::SecondOrderSections;

/// The parallel filter F_p of equation 6, applied without phase, and the factor n_d.
///
/// The same filter goes over both sides of the equation, so it distorts neither; it removes what
/// the model does not describe and makes the kept samples nearly independent.
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelDecimation {
    /// None leaves every signal as it is.
    filter: Option<(SecondOrderSections, Jump)>,
    factor: usize,
    cutoff_ratio: f64,
}

impl ParallelDecimation {
    /// A Chebyshev filter of type I with its cut-off at `cutoff_ratio` of the Nyquist frequency
    /// **after** decimation: `cheby1(order, ripple_db, cutoff_ratio/factor)`.
    ///
    /// # Errors
    /// [`SignalError::Factor`], and those of [`chebyshev1_low_pass`].
    pub fn chebyshev1(
        order: usize,
        ripple_db: f64,
        cutoff_ratio: f64,
        factor: usize,
    ) -> Result<Self, SignalError> {
        if factor == 0 {
            return Err(SignalError::Factor);
        }
        let filter = chebyshev1_low_pass(order, ripple_db, cutoff_ratio / factor as f64)?;
        let jump = Jump::over(&filter, factor - 1);
        Ok(Self { filter: Some((filter, jump)), factor, cutoff_ratio })
    }

    /// No filter, and every sample is kept: the paper's strict output error framework.
    pub fn none() -> Self {
        Self { filter: None, factor: 1, cutoff_ratio: 1.0 }
    }

    /// Whether there is no filter.
    pub fn is_none(&self) -> bool {
        self.filter.is_none()
    }

    /// The factor n_d: one sample in so many is kept.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// The cut-off as a fraction of the Nyquist frequency after decimation; 1 without a filter.
    pub fn cutoff_ratio(&self) -> f64 {
        self.cutoff_ratio
    }

    /// Power spectrum of white noise of unit power, filtered and decimated, at `ratio` of the
    /// Nyquist frequency after decimation: `1/n_d Σ_i |H|⁴` over the n_d frequencies that fold onto
    /// this one.
    pub fn noise_power(&self, ratio: f64) -> f64 {
        let Some((filter, _)) = &self.filter else { return 1.0 };
        let factor = self.factor as f64;
        let folded = (0..self.factor).map(|i| {
            let around = (ratio + 2.0 * i as f64) / factor;
            let (re, im) = filter.response(if around > 1.0 { 2.0 - around } else { around });
            (re * re + im * im).powi(2)
        });
        folded.sum::<f64>() / factor
    }

    /// The samples that are kept: multiples of the factor, counted from the first sample of the
    /// record, inside `counted`.
    pub fn kept(&self, counted: Range<usize>) -> impl Iterator<Item = usize> + Clone + use<> {
        (counted.start.next_multiple_of(self.factor)..counted.end).step_by(self.factor)
    }

    /// Filters `signal` over its whole length in place; the caller then reads the
    /// [`kept`](Self::kept) samples.
    ///
    /// # Errors
    /// As [`SecondOrderSections::filter_zero_phase`].
    pub fn filter(&self, signal: &mut [f64]) -> Result<(), SignalError> {
        self.filter.as_ref().map_or(Ok(()), |(filter, _)| {
            filter.filter_zero_phase(signal, filter.default_padding())
        })
    }

    /// Filters m signals over all `samples` of a record and gives the [`kept`](Self::kept) ones
    /// (kept × m).
    ///
    /// `read` writes the m values of a sample. It is called once for a sample, in order, so that
    /// the unfiltered signals need not be in memory together. A signal has the same bits whatever
    /// the others are, and those of [`filter`](Self::filter) but for rounding.
    ///
    /// # Errors
    /// As [`SecondOrderSections::filter_zero_phase`], with the first sample that has a bad value in
    /// any signal.
    pub fn decimate(
        &self,
        samples: usize,
        signals: usize,
        counted: Range<usize>,
        mut read: impl FnMut(usize, &mut [f64]),
    ) -> Result<DMatrix<f64>, SignalError> {
        let end = counted.end.min(samples);
        let kept = counted.start.min(end).div_ceil(self.factor)..end.div_ceil(self.factor);
        let Some((filter, jump)) = &self.filter else {
            let (mut values, mut rows) =
                (RowDVector::zeros(signals), DMatrix::zeros(kept.len(), signals));
            for (k, mut row) in kept.zip(rows.row_iter_mut()) {
                read(k, values.as_mut_slice());
                check_finite(k, values.as_slice())?;
                row.copy_from(&values);
            }
            return Ok(rows);
        };
        let record = Record::open(samples, signals, filter.default_padding(), read)?;
        jump.filter_zero_phase(filter, record, kept)
    }

    /// [`decimate`](Self::decimate) of signals in memory, samples × m.
    ///
    /// # Errors
    /// As [`decimate`](Self::decimate).
    pub fn decimate_columns(
        &self,
        signals: &DMatrix<f64>,
        counted: Range<usize>,
    ) -> Result<DMatrix<f64>, SignalError> {
        self.decimate(signals.nrows(), signals.ncols(), counted, |k, values| {
            for (signal, value) in values.iter_mut().enumerate() {
                *value = signals[(k, signal)];
            }
        })
    }
}
