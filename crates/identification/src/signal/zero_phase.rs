//! Forward and backward filtering, which cancels the phase (paper, section 3.1.1).

use super::error::SignalError;
use super::sections::{SecondOrderSections, Section};
use didim_dynamics::numeric::{Lanes, with_vector_instructions};

/// Number of samples that pass all sections before the next ones, small enough for the nearest
/// cache.
const BLOCK_SAMPLES: usize = 256;

/// Number of samples that continue the signal at each end, point-mirrored about its end value
/// (SciPy's `padtype="odd"`). The filter then starts on samples that move like the signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OddPadding {
    /// Samples at each end; the signal must be longer than this.
    pub samples: usize,
}

impl OddPadding {
    /// Returns `3 (order + 1)` samples, SciPy's default: `3 max(len(a), len(b))` in `filtfilt` and
    /// `3 (2 n_sections + 1 − [order odd])` in `sosfiltfilt` are both this number. For the
    /// Butterworth filter of order 4 it is 15, for the Chebyshev filter of order 8 it is 27.
    pub fn for_order(order: usize) -> Self {
        Self { samples: 3 * (order + 1) }
    }
}

impl SecondOrderSections {
    /// Returns [`OddPadding::for_order`] of this filter.
    pub fn default_padding(&self) -> OddPadding {
        OddPadding::for_order(self.order())
    }

    /// Filters `signal` in place, forward then backward, so that the phase is zero and the
    /// magnitude squared.
    ///
    /// Equals SciPy's `sosfiltfilt(sos, x, padtype="odd", padlen=padding.samples)`: each pass
    /// starts from the settled state for a constant input of the first padded value.
    ///
    /// # Errors
    /// [`SignalError::TooShort`] unless the signal is longer than the padding,
    /// [`SignalError::NotFinite`] with the first bad sample; the signal is then unchanged.
    pub fn filter_zero_phase(
        &self,
        signal: &mut [f64],
        padding: OddPadding,
    ) -> Result<(), SignalError> {
        let (samples, _) = signal.as_chunks_mut::<1>();
        self.filter_zero_phase_lanes(samples, padding)
    }

    /// Applies [`filter_zero_phase`](Self::filter_zero_phase) to `L` signals at once, interleaved
    /// by sample. The result of each signal is the same as alone, to the last bit. A few signals
    /// take barely longer than one, because the recursion waits for its own result.
    ///
    /// # Errors
    /// Those of one signal; a bad value in any lane rejects all.
    pub fn filter_zero_phase_lanes<const L: usize>(
        &self,
        signal: &mut [[f64; L]],
        padding: OddPadding,
    ) -> Result<(), SignalError> {
        let pad = padding.samples;
        let (Some(&first), Some(&last)) = (signal.first(), signal.last()) else {
            return Err(SignalError::TooShort { samples: 0, needed: pad.saturating_add(1) });
        };
        if signal.len() <= pad {
            return Err(SignalError::TooShort {
                samples: signal.len(),
                needed: pad.saturating_add(1),
            });
        }
        // Avoids a branch for each signal.
        let finite = |x: &[f64; L]| x.iter().fold(true, |all, value| all & value.is_finite());
        if let Some(index) = signal.iter().position(|x| !finite(x)) {
            return Err(SignalError::NotFinite { index });
        }

        let mirrored = |about: [f64; L], x: [f64; L]| {
            core::array::from_fn::<f64, L, _>(|l| 2.0 * about[l] - x[l])
        };
        // Continuations beyond both ends. The one before the start is needed forward only.
        let mut tail: Vec<[f64; L]> =
            signal.iter().rev().skip(1).take(pad).map(|&x| mirrored(last, x)).collect();

        let mut head: Vec<[f64; L]> =
            signal[1..=pad].iter().rev().map(|&x| mirrored(first, x)).collect();

        with_vector_instructions(
            #[inline(always)]
            || {
                let mut state = FilterState::settled_at(self, mirrored(first, signal[pad]));
                state.filter_forward(&mut head);
                state.filter_forward(signal);
                state.filter_forward(&mut tail);

                let end = tail.last().or(signal.last()).copied().unwrap_or(last);
                let mut state = FilterState::settled_at(self, end);
                state.filter_backward(&mut tail);
                state.filter_backward(signal);
            },
        );
        Ok(())
    }
}

/// Transposed direct form II states of every section, for `L` signals.
struct FilterState<'a, const L: usize> {
    filter: &'a SecondOrderSections,
    z: Vec<[[f64; L]; 2]>,
}

impl<'a, const L: usize> FilterState<'a, L> {
    /// Creates the state that a constant input of `level` settles to.
    fn settled_at(filter: &'a SecondOrderSections, mut level: [f64; L]) -> Self {
        let z = filter
            .sections
            .iter()
            .map(|section| {
                let (z, gain) = section.steady_state();
                let state = z.map(|z| level.map(|x| z * x));
                level = level.map(|x| gain * x);
                state
            })
            .collect();
        Self { filter, z }
    }

    /// Filters samples in place, in the order of the slice.
    #[inline(always)]
    fn filter_forward(&mut self, samples: &mut [[f64; L]]) {
        for block in samples.chunks_mut(BLOCK_SAMPLES) {
            for (section, z) in self.filter.sections.iter().zip(&mut self.z) {
                section.run(z, block.iter_mut());
            }
        }
    }

    /// Filters samples in place, last one first.
    #[inline(always)]
    fn filter_backward(&mut self, samples: &mut [[f64; L]]) {
        for block in samples.rchunks_mut(BLOCK_SAMPLES) {
            for (section, z) in self.filter.sections.iter().zip(&mut self.z) {
                section.run(z, block.iter_mut().rev());
            }
        }
    }
}

impl Section {
    /// Filters some samples with one section, whose state stays in registers meanwhile.
    #[inline(always)]
    fn run<'s, const L: usize>(
        &self,
        state: &mut [[f64; L]; 2],
        samples: impl Iterator<Item = &'s mut [f64; L]>,
    ) {
        let [mut z1, mut w] = state.map(Lanes);
        for x in samples {
            *x = self.step(Lanes(*x), &mut z1, &mut w).0;
        }
        *state = [z1.0, w.0];
    }
}
