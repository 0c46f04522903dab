//! Record whose samples are read once, in order, and kept in memory in sections.

use super::error::SignalError;
use super::zero_phase::OddPadding;
use didim_dynamics::numeric::{Lanes, WIDTH};

/// Consecutive samples of one signal.
pub type Group = Lanes<WIDTH>;

/// Function that writes a [`Group`] of every signal, starting at a given sample; samples beyond the
/// record are ignored. It is not a type parameter, because the filters would then be compiled for
/// each type.
pub(super) type Source<'a> = &'a mut dyn FnMut(usize, &mut [Group]);

/// Section of a record in memory, signal after signal.
pub(super) struct Record<'a> {
    source: Source<'a>,
    pub(super) samples: usize,
    pub(super) signals: usize,
    /// Number of samples of the continuation at each end.
    pub(super) padding: usize,
    /// First sample of each signal in this section.
    first_sample: usize,
    /// Number of samples that have been read.
    samples_read: usize,
    stride: usize,
    values: Vec<f64>,
    group: Vec<Group>,
}

impl<'a> Record<'a> {
    /// Opens the record. `capacity` is the largest number of samples in a section.
    pub(super) fn open_signals(
        samples: usize,
        signals: usize,
        padding: OddPadding,
        capacity: usize,
        source: Source<'a>,
    ) -> Result<Self, SignalError> {
        let needed = padding.samples.saturating_add(1);
        if samples < needed {
            return Err(SignalError::TooShort { samples, needed });
        }
        let stride = capacity + WIDTH;
        Ok(Self {
            source,
            samples,
            signals,
            padding: padding.samples,
            first_sample: 0,
            samples_read: 0,
            stride,
            values: vec![0.0; signals * stride],
            group: vec![Lanes([0.0; WIDTH]); signals],
        })
    }

    /// Advances to the section that begins with sample `first` and has the wanted number of
    /// samples.
    pub(super) fn advance(&mut self, first: usize, wanted: usize) {
        let (from, stored) = (first - self.first_sample, self.samples_read - first);
        for values in self.values.chunks_exact_mut(self.stride) {
            values.copy_within(from..from + stored, 0);
        }
        self.first_sample = first;
        while self.samples_read < (first + wanted).min(self.samples) {
            (self.source)(self.samples_read, &mut self.group);
            let inside = WIDTH.min(self.samples - self.samples_read);
            let place = self.samples_read - self.first_sample;
            for (values, group) in self.values.chunks_exact_mut(self.stride).zip(&self.group) {
                values[place..place + WIDTH].copy_from_slice(&group.0);
            }
            self.samples_read += inside;
        }
    }

    /// Returns the section of every signal; values after the section are not valid.
    pub(super) fn section_slices(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.stride)
    }

    /// Checks the first `wanted` samples of the section. The error names the first sample with a
    /// value that is not finite.
    pub(super) fn check_finite(&self, wanted: usize) -> Result<(), SignalError> {
        let bad = |signal: &[f64]| signal[..wanted].iter().position(|value| !value.is_finite());
        match self.section_slices().filter_map(bad).min() {
            Some(position) => Err(SignalError::NotFinite { index: self.first_sample + position }),
            None => Ok(()),
        }
    }
}

/// Returns the samples of a signal from `first` on; beyond the last sample, the last one repeats.
#[inline(always)]
pub(crate) fn group_of(signal: &[f64], first: usize) -> Group {
    match signal[first..].first_chunk() {
        Some(samples) => Lanes(*samples),
        None => Lanes::from_fn(|l| signal[(first + l).min(signal.len() - 1)]),
    }
}
