//! The samples of a record that filters read once, in order.

use nalgebra::{DMatrix, DVector};

use super::error::SignalError;
use super::zero_phase::OddPadding;

/// The values of a sample are filled up to a multiple of so many: a matrix product of fewer would
/// sum in another order.
const ROOM: usize = 8;

/// The samples of a record in order, with those that its mirrored continuations are made of.
pub(super) struct Record<R> {
    source: R,
    pub(super) samples: usize,
    pub(super) signals: usize,
    /// Values of a sample in memory; those beyond the signals are 0.
    pub(super) room: usize,
    /// The first samples, read ahead.
    first: DMatrix<f64>,
    /// The last samples, as far as they have been read.
    last: DMatrix<f64>,
}

impl<R: FnMut(usize, &mut [f64])> Record<R> {
    pub(super) fn open(
        samples: usize,
        signals: usize,
        padding: OddPadding,
        source: R,
    ) -> Result<Self, SignalError> {
        let needed = padding.samples.saturating_add(1);
        if samples < needed {
            return Err(SignalError::TooShort { samples, needed });
        }
        let room = signals.next_multiple_of(ROOM).max(ROOM);
        let mut record = Self {
            source,
            samples,
            signals,
            room,
            first: DMatrix::zeros(room, 0),
            last: DMatrix::zeros(room, needed),
        };
        let mut first = DMatrix::zeros(room, needed);
        for (k, mut sample) in first.column_iter_mut().enumerate() {
            record.read(k, sample.as_mut_slice())?;
        }
        record.first = first;
        Ok(record)
    }

    /// The values of sample `k`, from the source unless they have been read ahead.
    pub(super) fn read(&mut self, k: usize, sample: &mut [f64]) -> Result<(), SignalError> {
        if k < self.first.ncols() {
            sample.copy_from_slice(self.first.column(k).as_slice());
        } else {
            (self.source)(k, &mut sample[..self.signals]);
            check_finite(k, sample)?;
        }
        if let Some(column) = (k + self.last.ncols()).checked_sub(self.samples) {
            self.last.column_mut(column).as_mut_slice().copy_from_slice(sample);
        }
        Ok(())
    }

    /// Samples of each continuation.
    pub(super) fn padding(&self) -> usize {
        self.last.ncols() - 1
    }

    /// The continuation `k` samples before the first one, point-mirrored about it.
    pub(super) fn before(&self, k: usize) -> DVector<f64> {
        self.first.column(0) * 2.0 - self.first.column(k)
    }

    /// The continuation `k` samples after the last one.
    pub(super) fn after(&self, k: usize) -> DVector<f64> {
        let last = self.padding();
        self.last.column(last) * 2.0 - self.last.column(last - k)
    }
}

/// Whether every value of sample `index` is finite.
pub(super) fn check_finite(index: usize, sample: &[f64]) -> Result<(), SignalError> {
    // Without a branch for each value.
    let finite = sample.iter().fold(true, |finite, x| finite & x.is_finite());
    if finite { Ok(()) } else { Err(SignalError::NotFinite { index }) }
}
