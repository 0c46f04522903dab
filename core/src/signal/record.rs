//! The samples of a record that filters read once, in order, some of them at a time.

use super::error::SignalError;
use super::zero_phase::OddPadding;
use crate::numeric::{Lanes, WIDTH};

/// Consecutive samples of one signal.
pub type Group = Lanes<WIDTH>;

/// What writes a [`Group`] of every signal, from a sample on; samples beyond the record do not count.
/// Not a type parameter, of which every one would compile the filters anew.
pub(super) type Source<'a> = &'a mut dyn FnMut(usize, &mut [Group]);

/// A stretch of a record in memory, signal after signal.
pub(super) struct Record<'a> {
    source: Source<'a>,
    pub(super) samples: usize,
    pub(super) signals: usize,
    /// Samples of each continuation.
    pub(super) padding: usize,
    /// The sample that each signal begins with here.
    first: usize,
    /// How many samples have been read.
    read: usize,
    stride: usize,
    values: Vec<f64>,
    group: Vec<Group>,
}

impl<'a> Record<'a> {
    /// With room for so many samples at once.
    pub(super) fn open(
        samples: usize,
        signals: usize,
        padding: OddPadding,
        room: usize,
        source: Source<'a>,
    ) -> Result<Self, SignalError> {
        let needed = padding.samples.saturating_add(1);
        if samples < needed {
            return Err(SignalError::TooShort { samples, needed });
        }
        let stride = room + WIDTH;
        Ok(Self {
            source,
            samples,
            signals,
            padding: padding.samples,
            first: 0,
            read: 0,
            stride,
            values: vec![0.0; signals * stride],
            group: vec![Lanes([0.0; WIDTH]); signals],
        })
    }

    /// Goes on to the stretch that begins with sample `first`, of which so many are wanted.
    pub(super) fn advance(&mut self, first: usize, wanted: usize) {
        let (from, kept) = (first - self.first, self.read - first);
        for values in self.values.chunks_exact_mut(self.stride) {
            values.copy_within(from..from + kept, 0);
        }
        self.first = first;
        while self.read < (first + wanted).min(self.samples) {
            (self.source)(self.read, &mut self.group);
            let inside = WIDTH.min(self.samples - self.read);
            let at = self.read - self.first;
            for (values, group) in self.values.chunks_exact_mut(self.stride).zip(&self.group) {
                values[at..at + WIDTH].copy_from_slice(&group.0);
            }
            self.read += inside;
        }
    }

    /// The stretch of every signal, and beyond it what does not count.
    pub(super) fn stretches(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.stride)
    }

    /// The first sample of which a value is not finite, of so many.
    pub(super) fn check_finite(&self, wanted: usize) -> Result<(), SignalError> {
        let bad = |signal: &[f64]| signal[..wanted].iter().position(|value| !value.is_finite());
        match self.stretches().filter_map(bad).min() {
            Some(position) => Err(SignalError::NotFinite { index: self.first + position }),
            None => Ok(()),
        }
    }
}

/// The samples of a signal from `first` on; beyond the last sample, the last.
#[inline(always)]
pub(crate) fn group_of(signal: &[f64], first: usize) -> Group {
    match signal[first..].first_chunk() {
        Some(samples) => Lanes(*samples),
        None => Lanes::from_fn(|l| signal[(first + l).min(signal.len() - 1)]),
    }
}
