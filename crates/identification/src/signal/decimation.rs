//! Parallel decimation: one filter for every column and for the torque, then every n-th sample
//! (paper, equation 6).

use core::ops::Range;

use nalgebra::DMatrix;

use super::design::chebyshev1_low_pass;
use super::difference::difference_neighbours;
use super::error::SignalError;
use super::record::{Group, Record};
use super::sections::SecondOrderSections;
use super::zero_phase_decimation::ZeroPhaseDecimator;
use didim_dynamics::numeric::{Lanes, WIDTH};

/// Parallel filter F_p of equation 6, applied with zero phase, and the decimation factor n_d.
///
/// The same filter is applied to both sides of the equation, so the equation still holds. It
/// removes noise and model errors above its cut-off and makes the kept samples nearly independent.
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelDecimation {
    /// `None` leaves every signal unchanged.
    filter: Option<(SecondOrderSections, ZeroPhaseDecimator)>,
    factor: usize,
    cutoff_ratio: f64,
}

impl ParallelDecimation {
    /// Designs a Chebyshev filter of type I with its cut-off at `cutoff_ratio` of the Nyquist
    /// frequency **after** decimation: `cheby1(order, ripple_db, cutoff_ratio/factor)`.
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

    /// Creates a decimation without filter that keeps every sample: the paper's strict output error
    /// framework.
    pub fn identity() -> Self {
        Self { filter: None, factor: 1, cutoff_ratio: 1.0 }
    }

    /// Returns true if there is no filter.
    pub fn is_none(&self) -> bool {
        self.filter.is_none()
    }

    /// Returns the factor n_d: one of n_d samples is kept.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// Returns the cut-off as a fraction of the Nyquist frequency after decimation; 1 without a
    /// filter.
    pub fn cutoff_ratio(&self) -> f64 {
        self.cutoff_ratio
    }

    /// Returns the power spectrum of white noise of unit power, filtered and decimated, at `ratio`
    /// of the Nyquist frequency after decimation: `1/n_d Σ_i |H|⁴` over the n_d frequencies that
    /// fold onto this one.
    pub fn noise_power(&self, ratio: f64) -> f64 {
        let Some((filter, _)) = &self.filter else { return 1.0 };
        // The frequencies before folding are taken in the order ratio, 2 − ratio, 2 + ratio, 4 −
        // ratio, …. The passed power falls from the cut-off on and soon contributes nothing.
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

    /// Returns the kept samples: multiples of the factor, counted from the first sample of the
    /// record, inside `counted`.
    pub fn kept_samples(
        &self,
        counted: Range<usize>,
    ) -> impl Iterator<Item = usize> + Clone + use<> {
        (counted.start.next_multiple_of(self.factor)..counted.end).step_by(self.factor)
    }

    /// Filters `signal` over its full length in place; the caller then reads the
    /// [`kept`](Self::kept_samples) samples.
    ///
    /// # Errors
    /// Those of [`SecondOrderSections::filter_zero_phase`].
    pub fn filter(&self, signal: &mut [f64]) -> Result<(), SignalError> {
        self.filter.as_ref().map_or(Ok(()), |(filter, _)| {
            filter.filter_zero_phase(signal, filter.default_padding())
        })
    }

    /// Filters m signals over all `samples` of a record and returns the
    /// [`kept`](Self::kept_samples) ones (kept × m).
    ///
    /// `read` writes a [`Group`] of each of the m signals, starting at a given sample. Values that
    /// `read` writes beyond the record are ignored. It is called in ascending order and once per
    /// sample, so that the unfiltered signals need not all be in memory. The result of one signal
    /// does not depend on the other signals, to the last bit. Except for rounding, it equals that
    /// of [`filter`](Self::filter).
    ///
    /// # Errors
    /// Those of [`SecondOrderSections::filter_zero_phase`], with the first sample that has a bad
    /// value in any signal.
    pub fn decimate_groups(
        &self,
        samples: usize,
        signals: usize,
        counted: Range<usize>,
        read: &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<DMatrix<f64>, SignalError> {
        let rows_kept = self.kept_rows(samples, &counted);
        if let Some(filter) = &self.filter {
            let [rows, _] = filter_and_keep(filter, [samples, signals], rows_kept, read, false)?;
            return Ok(rows);
        }
        let mut rows = DMatrix::zeros(rows_kept.len(), signals);
        let mut group = vec![Lanes([0.0; WIDTH]); signals];
        for first in rows_kept.clone().step_by(WIDTH) {
            read(first, &mut group);
            let count = WIDTH.min(rows_kept.end - first);
            let bad = |k: &usize| group.iter().any(|values| !values.0[*k].is_finite());
            if let Some(k) = (0..count).find(bad) {
                return Err(SignalError::NotFinite { index: first + k });
            }
            let mut rows = rows.rows_mut(first - rows_kept.start, count);
            for (mut rows, values) in rows.column_iter_mut().zip(&group) {
                rows.copy_from_slice(&values.0[..count]);
            }
        }
        Ok(rows)
    }

    /// Does the same as [`decimate_groups`](Self::decimate_groups) and also returns differences.
    /// The difference at a kept sample is the filtered value of the next sample minus that of the
    /// previous one. Half the sample rate times this difference is the
    /// [`central_difference`](super::central_difference). Beyond both ends of the record, a signal
    /// continues as in the filters: point-mirrored about its last value.
    ///
    /// # Errors
    /// Those of [`decimate_groups`](Self::decimate_groups).
    pub fn decimate_with_differences(
        &self,
        samples: usize,
        signals: usize,
        counted: Range<usize>,
        read: &mut dyn FnMut(usize, &mut [Group]),
    ) -> Result<[DMatrix<f64>; 2], SignalError> {
        let rows_kept = self.kept_rows(samples, &counted);
        if let Some(filter) = &self.filter {
            return filter_and_keep(filter, [samples, signals], rows_kept, read, true);
        }
        let first = rows_kept.start.saturating_sub(1);
        let rows = self.decimate_groups(samples, signals, first..rows_kept.end + 1, read)?;
        let differences =
            DMatrix::from_fn(rows_kept.len(), signals, |row: usize, signal: usize| {
                let (before, after, factor) =
                    difference_neighbours(rows_kept.start + row, samples, 2.0);
                (rows[(after - first, signal)] - rows[(before - first, signal)]) * factor
            });
        Ok([rows.rows(rows_kept.start - first, rows_kept.len()).into_owned(), differences])
    }

    /// Returns the kept samples as rows: multiples of the factor, inside record and `counted`.
    fn kept_rows(&self, samples: usize, counted: &Range<usize>) -> Range<usize> {
        let end = counted.end.min(samples);
        counted.start.min(end).div_ceil(self.factor)..end.div_ceil(self.factor)
    }

    /// Does the same as [`decimate_groups`](Self::decimate_groups) for signals that are read one
    /// sample at a time.
    ///
    /// # Errors
    /// Those of [`decimate_groups`](Self::decimate_groups).
    pub fn decimate_signals(
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

    /// Does the same as [`decimate_signals`](Self::decimate_signals) for signals in memory,
    /// samples × m.
    ///
    /// # Errors
    /// Those of [`decimate_signals`](Self::decimate_signals).
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

/// Returns the kept rows of these samples and signals after a filter. The differences are empty
/// unless requested.
fn filter_and_keep(
    (filter, decimator): &(SecondOrderSections, ZeroPhaseDecimator),
    [samples, signals]: [usize; 2],
    fixed: Range<usize>,
    read: &mut dyn FnMut(usize, &mut [Group]),
    with_differences: bool,
) -> Result<[DMatrix<f64>; 2], SignalError> {
    let padding = filter.default_padding();
    let capacity = decimator.capacity(padding.samples);
    let record = Record::open_signals(samples, signals, padding, capacity, read)?;
    decimator.filter_zero_phase(record, fixed, with_differences)
}
