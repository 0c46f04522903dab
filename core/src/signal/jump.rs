//! Zero-phase filtering of many signals of which few samples are wanted.
//!
//! A filter is linear in its state and its input, so that both passes can jump from one wanted
//! sample to the next: one matrix product for all signals in place of two recursions over every
//! sample, each of which waits for its own result.

use core::ops::Range;

use nalgebra::DMatrix;

use super::error::SignalError;
use super::record::Record;
use super::sections::SecondOrderSections;
use super::zero_phase::State;

/// Both passes over the same samples x, the forward one from the state z, the backward one from s:
///
/// ```text
/// forward    z' = A z + F x
/// backward   s' = A s + P z + G x
/// ```
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Jump {
    /// Length of x.
    samples: usize,
    /// `[F P; A G]` transposed, the samples and then the states by the states of both passes.
    passes: DMatrix<f64>,
    /// A transposed.
    power: DMatrix<f64>,
}

impl Jump {
    /// Over so many samples, from what the recursion makes of each unit state and unit sample.
    pub(super) fn over(filter: &SecondOrderSections, samples: usize) -> Self {
        let states = filter.states();
        let mut passes = DMatrix::zeros(samples + states, 2 * states);
        for (unit, mut row) in passes.row_iter_mut().enumerate() {
            let mut x = vec![[0.0]; samples];
            let mut forward = State::zero(filter);
            match x.get_mut(unit) {
                Some(sample) => *sample = [1.0],
                None => forward.z[(unit - samples) / 2][(unit - samples) % 2] = [1.0],
            }
            forward.forward(&mut x);
            let mut backward = State::zero(filter);
            backward.backward(&mut x);
            let after = forward.z.iter().chain(&backward.z).flatten();
            for (to, [from]) in row.iter_mut().zip(after) {
                *to = *from;
            }
        }
        let power = passes.view((samples, 0), (states, states)).into_owned();
        Self { samples, passes, power }
    }

    /// Filters the m signals of a record as [`SecondOrderSections::filter_zero_phase`] does and
    /// gives one sample after each jump: the `wanted` ones (so many × m), which are in the record.
    ///
    /// For the time it takes, it has every state of the filter in memory at each of them.
    ///
    /// # Errors
    /// [`SignalError::NotFinite`] as for one signal.
    pub(super) fn filter_zero_phase(
        &self,
        filter: &SecondOrderSections,
        mut record: Record<impl FnMut(usize, &mut [f64])>,
        wanted: Range<usize>,
    ) -> Result<DMatrix<f64>, SignalError> {
        let (room, states, factor) = (record.room, filter.states(), self.samples + 1);
        let mut state = SideBySide::settled(filter, record.before(record.padding()).as_slice());
        for k in (1..=record.padding()).rev() {
            state.step(record.before(k).as_mut_slice());
        }

        let last = (record.samples - 1) / factor;
        let mut kept = DMatrix::zeros(room, last + 1);
        // P z + G x of every jump.
        let mut carried = DMatrix::zeros(room, last * states);
        // The samples that are jumped over, and the states before them.
        let mut block = DMatrix::zeros(room, self.samples + states);
        let mut after = DMatrix::zeros(room, 2 * states);
        for multiple in 0..last {
            let mut sample = kept.column_mut(multiple);
            record.read(multiple * factor, sample.as_mut_slice())?;
            state.step(sample.as_mut_slice());
            for (k, mut sample) in (1..factor).zip(block.column_iter_mut()) {
                record.read(multiple * factor + k, sample.as_mut_slice())?;
            }
            block.columns_mut(self.samples, states).copy_from(&state.z);
            after.gemm(1.0, &block, &self.passes, 0.0);
            state.z.copy_from(&after.columns(0, states));
            carried
                .columns_mut(multiple * states, states)
                .copy_from(&after.columns(states, states));
        }

        // From the last multiple to the end of the continuation both passes go step by step.
        let rest = record.samples - last * factor;
        let mut end = DMatrix::zeros(room, rest + record.padding());
        for (k, mut sample) in end.column_iter_mut().enumerate() {
            if k < rest {
                record.read(last * factor + k, sample.as_mut_slice())?;
            } else {
                sample.copy_from(&record.after(k + 1 - rest));
            }
            state.step(sample.as_mut_slice());
        }
        let mut state = SideBySide::settled(filter, end.column(end.ncols() - 1).as_slice());
        for k in (0..end.ncols()).rev() {
            state.step(end.column_mut(k).as_mut_slice());
        }
        kept.set_column(last, &end.column(0));

        let mut jumped = DMatrix::zeros(room, states);
        for multiple in (wanted.start..last).rev() {
            jumped.copy_from(&carried.columns(multiple * states, states));
            jumped.gemm(1.0, &state.z, &self.power, 1.0);
            core::mem::swap(&mut state.z, &mut jumped);
            state.step(kept.column_mut(multiple).as_mut_slice());
        }
        Ok(kept.view((0, wanted.start), (record.signals, wanted.len())).transpose())
    }
}

/// States of every section for signals side by side: m × states, the columns in the order of
/// [`State`].
struct SideBySide<'a> {
    filter: &'a SecondOrderSections,
    z: DMatrix<f64>,
}

impl<'a> SideBySide<'a> {
    /// The states that constant inputs of these levels settle to.
    fn settled(filter: &'a SecondOrderSections, levels: &[f64]) -> Self {
        let unit = State::settled(filter, [1.0]);
        let unit: Vec<f64> = unit.z.into_iter().flatten().flatten().collect();
        let z = DMatrix::from_fn(levels.len(), unit.len(), |signal, k| levels[signal] * unit[k]);
        Self { filter, z }
    }

    /// One sample of each signal in place.
    fn step(&mut self, sample: &mut [f64]) {
        let states = self.z.as_mut_slice().chunks_exact_mut(2 * sample.len());
        for (section, z) in self.filter.sections.iter().zip(states) {
            let (z1, z2) = z.split_at_mut(sample.len());
            for ((x, z1), z2) in sample.iter_mut().zip(z1).zip(z2) {
                *x = section.step(*x, z1, z2);
            }
        }
    }
}
