//! Parallel decimation: one filter for every column and for the torque, then every n-th sample
//! (paper, equation 6).

use core::ops::Range;

use nalgebra::DMatrix;

use super::design::chebyshev1_low_pass;
use super::difference::neighbours;
use super::error::SignalError;
use super::record::{Group, Record};
use super::sections::SecondOrderSections;
use super::zero_phase_decimation::ZeroPhaseDecimator;
use crate::numeric::{Lanes, WIDTH};

/// The parallel filter F_p of equation 6, applied without phase, and the factor n_d.
///
/// The same filter goes over both sides of the equation, so it distorts neither; it removes what
/// the model does not describe and makes the kept samples nearly independent.
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelDecimation {
    /// None leaves every signal as it is.
    filter: Option<(SecondOrderSections, ZeroPhaseDecimator)>,
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
        let decimator = ZeroPhaseDecimator::new(&filter, factor - 1);
        Ok(Self { filter: Some((filter, decimator)), factor, cutoff_ratio })
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
        // In the order of the frequencies ratio, 2 − ratio, 2 + ratio, 4 − ratio, … before they fold:
        // what passes falls from the cut-off on, and soon adds nothing.
        let factor = self.factor as f64;
        let mut folded = 0.0;
        for i in 0..self.factor {
            let fold = 2.0 * i.div_ceil(2) as f64;
            let (re, im) =
                filter.response((if i % 2 == 0 { fold + ratio } else { fold - ratio }) / factor);
            let power = (re * re + im * im).powi(2);
            folded += power;
            if i > 1 && power <= f64::EPSILON * folded / factor {
                break;
            }
        }
        folded / factor
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
    /// `read` writes a [`Group`] of each of the m signals, from a sample on; what it writes
    /// beyond the record does not count. It is called in order and once for a sample, so that the unfiltered signals
    /// need not be in memory together. A signal has the same bits whatever the others are, and those
    /// of [`filter`](Self::filter) but for rounding.
    ///
    /// # Errors
    /// As [`SecondOrderSections::filter_zero_phase`], with the first sample that has a bad value in
    /// any signal.
    pub fn decimate_groups(
        &self,
        samples: usize,
        signals: usize,
        counted: Range<usize>,
        read: &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<DMatrix<f64>, SignalError> {
        let kept = self.kept_rows(samples, &counted);
        if let Some(filter) = &self.filter {
            let [rows, _] = filtered(filter, [samples, signals], kept, read, false)?;
            return Ok(rows);
        }
        let mut rows = DMatrix::zeros(kept.len(), signals);
        let mut group = vec![Lanes([0.0; WIDTH]); signals];
        for first in kept.clone().step_by(WIDTH) {
            read(first, &mut group);
            let count = WIDTH.min(kept.end - first);
            let bad = |k: &usize| group.iter().any(|values| !values.0[*k].is_finite());
            if let Some(k) = (0..count).find(bad) {
                return Err(SignalError::NotFinite { index: first + k });
            }
            let mut rows = rows.rows_mut(first - kept.start, count);
            for (mut rows, values) in rows.column_iter_mut().zip(&group) {
                rows.copy_from_slice(&values.0[..count]);
            }
        }
        Ok(rows)
    }

    /// [`decimate_groups`](Self::decimate_groups), and of each kept sample how much the filtered signal
    /// grows from the sample before to the one after: times half the sample rate, its
    /// [`central_difference`](super::central_difference). Beyond both ends a signal is continued as
    /// filters continue it, by its mirror image about the last value.
    ///
    /// # Errors
    /// As [`decimate_groups`](Self::decimate_groups).
    pub fn decimate_with_differences(
        &self,
        samples: usize,
        signals: usize,
        counted: Range<usize>,
        read: &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<[DMatrix<f64>; 2], SignalError> {
        let kept = self.kept_rows(samples, &counted);
        if let Some(filter) = &self.filter {
            return filtered(filter, [samples, signals], kept, read, true);
        }
        let first = kept.start.saturating_sub(1);
        let rows = self.decimate_groups(samples, signals, first..kept.end + 1, read)?;
        let difference = |row: usize, signal: usize| {
            let (before, after, factor) = neighbours(kept.start + row, samples, 2.0);
            (rows[(after - first, signal)] - rows[(before - first, signal)]) * factor
        };
        let differences = DMatrix::from_fn(kept.len(), signals, difference);
        Ok([rows.rows(kept.start - first, kept.len()).into_owned(), differences])
    }

    /// The kept samples as rows: multiples of the factor, inside record and `counted`.
    fn kept_rows(&self, samples: usize, counted: &Range<usize>) -> Range<usize> {
        let end = counted.end.min(samples);
        counted.start.min(end).div_ceil(self.factor)..end.div_ceil(self.factor)
    }

    /// [`decimate_groups`](Self::decimate_groups) of signals that are known a sample at a time.
    ///
    /// # Errors
    /// As [`decimate_groups`](Self::decimate_groups).
    pub fn decimate(
        &self,
        samples: usize,
        signals: usize,
        counted: Range<usize>,
        read: &mut dyn FnMut(usize, &mut [f64]),
    ) -> Result<DMatrix<f64>, SignalError> {
        let mut values = vec![0.0; signals];
        self.decimate_groups(samples, signals, counted, &mut |first, group| {
            for k in first..samples.min(first + WIDTH) {
                read(k, &mut values);
                for (group, value) in group.iter_mut().zip(&values) {
                    group.0[k - first] = *value;
                }
            }
        })
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
        let samples = signals.nrows();
        self.decimate_groups(samples, signals.ncols(), counted, &mut |first, group| {
            let last = samples.min(first + WIDTH);
            for (group, signal) in group.iter_mut().zip(signals.column_iter()) {
                group.0[..last - first].copy_from_slice(signal.rows_range(first..last).as_slice());
            }
        })
    }
}

/// The kept rows of so many samples of so many signals behind a filter; no differences unless they are wanted.
fn filtered(
    (filter, decimator): &(SecondOrderSections, ZeroPhaseDecimator),
    [samples, signals]: [usize; 2],
    kept: Range<usize>,
    read: &mut dyn FnMut(usize, &mut [Group]),
    with_differences: bool,
) -> Result<[DMatrix<f64>; 2], SignalError> {
    let padding = filter.default_padding();
    let room = decimator.room(padding.samples);
    let record = Record::open(samples, signals, padding, room, read)?;
    decimator.filter_zero_phase(record, kept, with_differences)
}
