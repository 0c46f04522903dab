//! Zero-phase filtering and decimation of many signals in one step: the recursive filter in its
//! parallel form, by partial-fraction expansion (Oppenheim & Schafer, *Discrete-Time Signal
//! Processing*, sections 3.3 and 6.3.3), evaluated at the decimated rate. `docs/method/filters.md`,
//! "The decimating zero-phase filter", derives it.
//!
//! Forward and backward, the filter is a sum of modes that decay to both sides. From one kept
//! sample to the next a mode's state is multiplied by pⁿ, and the samples between are added with
//! constant weights. The backward pass does the same from the other side. The weights of both sides
//! are mirrored, so that sums and differences of mirrored samples need half of the products.
//!
//! The backward pass starts before the whole record has been read. It starts far enough ahead that
//! the modes have then lost the effect of their initial states. So the required memory does not
//! depend on the length of the record.

use core::ops::Range;

use nalgebra::DMatrix;

use super::complex_lanes::ComplexLanes;
use super::error::SignalError;
use super::mode_group::ModeGroup;
use super::modes::Modes;
use super::record::Record;
use super::sections::SecondOrderSections;
use didim_dynamics::numeric::{WIDTH, with_vector_instructions};

/// Largest share of its initial state that a mode may keep after the start of the backward pass.
const MAX_INITIAL_SHARE: f64 = 1e-18;

/// Number of blocks in one backward pass, relative to the number of blocks that it needs for
/// settling. All but one of these parts produce new results.
const BACKWARD_BLOCK: usize = 5;

/// Smallest number of samples of a section.
const SECTION: usize = 64;

/// Filter that is evaluated, forward and backward, at one sample of each block.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ZeroPhaseDecimator {
    modes: Modes,
    flank_gain: f64,
    /// Number of samples between two kept samples.
    samples: usize,
    groups: Vec<ModeGroup>,
    /// Number of blocks after which no mode depends on its initial state.
    memory_blocks: usize,
}

impl ZeroPhaseDecimator {
    /// Creates the decimator with this number of samples between two kept ones.
    pub(super) fn new(filter: &SecondOrderSections, samples: usize) -> Self {
        let modes = Modes::from_sections(filter);
        let groups = modes.modes.chunks(WIDTH);
        let groups = groups.map(|modes| ModeGroup::new(modes, samples)).collect();
        let slowest = modes.modes.iter().map(|mode| mode.pole.norm()).fold(0.0, f64::max);
        let blocks = MAX_INITIAL_SHARE.ln() / (slowest.ln() * (samples + 1) as f64);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "above 0, and casts saturate"
        )]
        let memory = blocks.ceil().max(1.0) as usize;
        Self { flank_gain: modes.flank_gain(), modes, samples, groups, memory_blocks: memory }
    }

    /// Returns the largest number of samples of a section: some blocks, or the remainder at the end
    /// of the record.
    pub(super) fn capacity(&self, padding: usize) -> usize {
        self.section_blocks() * (self.samples + 1) + padding + 1
    }

    /// Returns the number of blocks of a section. Each section is moved in memory, one signal after
    /// the other.
    fn section_blocks(&self) -> usize {
        SECTION.div_ceil(self.samples + 1)
    }

    /// Advances a record to the section with a block, out of so many blocks. Returns the place of
    /// the block in the section.
    fn advance(&self, record: &mut Record<'_>, block: usize, blocks: usize) -> usize {
        let (factor, of_section) = (self.samples + 1, self.section_blocks());
        if block.is_multiple_of(of_section) {
            record.advance(block * factor, of_section.min(blocks - block) * factor + 1);
        }
        block % of_section * factor
    }

    /// Filters the signals of a record as [`SecondOrderSections::filter_zero_phase`] does. It
    /// returns the first sample of each of the `wanted` blocks (blocks × signals), which begin in
    /// the record. For each it also returns the filtered sample after it minus the one before.
    ///
    /// ```text
    /// S_k = Σ p^(m−1) x_(k−m)    B_k = Σ p^(m−1) x_(k+m)    y_k = g_0 x_k + Σ c (S_k + B_k)
    /// S_(k+1) = p S_k + x_k      S_(k−1) = (S_k − x_(k−1))/p
    /// y_(k+1) − y_(k−1) = (g_0 − Σ c/p) (x_(k+1) − x_(k−1)) + Σ c (p − 1/p) (S_k − B_k)
    /// ```
    ///
    /// The differences are empty unless requested. The memory holds the contribution of each block
    /// to the backward pass, a number per mode, for as many blocks as one backward pass covers.
    ///
    /// # Errors
    /// [`SignalError::NotFinite`] as for one signal.
    pub(super) fn filter_zero_phase(
        &self,
        mut record: Record<'_>,
        wanted: Range<usize>,
        with_differences: bool,
    ) -> Result<[DMatrix<f64>; 2], SignalError> {
        let (factor, count) = (self.samples + 1, self.groups.len());
        // The last block is followed by the samples that the continuation mirrors.
        let blocks = (record.samples - record.padding - 1) / factor;
        record.advance(0, record.padding + 1);
        let starts =
            record.section_slices().flat_map(|signal| self.initial_states(signal, record.padding));
        let mut states: Vec<ComplexLanes> = starts.collect();
        // Sample before the next one; the first comes from the continuation.
        let mut before: Vec<f64> = record.section_slices().map(|x| 2.0 * x[0] - x[1]).collect();

        let signals = record.signals;
        let mut rows = OutputRows {
            output: DMatrix::zeros(wanted.len(), signals),
            differences: DMatrix::zeros(wanted.len(), if with_differences { signals } else { 0 }),
            requested_rows: wanted,
        };
        let at_once = self.memory_blocks.saturating_mul(BACKWARD_BLOCK).min(blocks);
        let mut passed = ForwardPass::with_capacity(at_once * signals, count);
        for block in 0..blocks {
            if block - passed.first_block == at_once {
                let mut nothing = vec![ComplexLanes::ZERO; signals * count];
                let end = block - self.memory_blocks;
                self.go_back(&passed, block, end, &mut nothing, &mut rows);
                passed.forget_before(end, signals, count);
            }
            let offset = self.advance(&mut record, block, blocks);
            let mut finite = true;
            let row = rows.row_of(block);
            with_vector_instructions(
                #[inline(always)]
                || {
                    let stretches = record.section_slices().zip(states.chunks_exact_mut(count));
                    for (signal, (section, states)) in stretches.enumerate() {
                        let values = &section[offset..=offset + factor];
                        let sample = values[0];
                        let mut filtered = self.modes.centre_gain * sample;
                        let mut difference = self.flank_gain * (values[1] - before[signal]);
                        for (of, state) in self.groups.iter().zip(states) {
                            filtered += of.amplitude.dot(state);
                            difference += of.slope.dot(state);
                            let [sums, mirrored] = of.power_sums(&values[1..factor]);
                            *state = of
                                .pole_power
                                .product(&state.step(&of.pole, sample))
                                .sum_with(&sums);
                            passed.backward_contributions.push(mirrored);
                            // A value that is not finite must be detected even if its weight is 0.
                            finite &= sums.re.0[0].is_finite();
                        }
                        passed.first_samples.push(sample);
                        before[signal] = values[factor - 1];
                        if let Some(row) = row {
                            rows.add_output(row, signal, [filtered, difference]);
                        }
                        finite &= sample.is_finite();
                    }
                },
            );
            if !finite {
                record.check_finite(offset + factor)?;
            }
        }

        let remaining = record.samples - blocks * factor;
        record.advance(blocks * factor, remaining);
        record.check_finite(remaining)?;
        let blocks_of = (blocks, factor, remaining);
        self.filter_ends(&record, blocks_of, &mut states, &before, &mut rows);
        self.go_back(&passed, blocks, blocks, &mut states, &mut rows);
        Ok([rows.output, rows.differences])
    }

    /// Filters the samples after the last block and their continuation.
    fn filter_ends(
        &self,
        record: &Record<'_>,
        (blocks, factor, remaining): (usize, usize, usize),
        states: &mut [ComplexLanes],
        before: &[f64],
        rows: &mut OutputRows,
    ) {
        let count = self.groups.len();
        let stretches = record.section_slices().zip(states.chunks_exact_mut(count));
        for (signal, (values, states)) in stretches.enumerate() {
            let values = &values[..remaining];
            let mut add = |position: usize, both: [f64; 2]| {
                let row = rows.row_of(blocks + position / factor);
                let row = row.filter(|_| position.is_multiple_of(factor) && position < remaining);
                if let Some(row) = row {
                    rows.add_output(row, signal, both);
                }
            };
            self.filter_end(before[signal], values, record.padding, states, &mut add);
        }
    }

    /// Runs the backward pass from just before block `from` to the first block that only the
    /// forward pass has processed. Adds the results of the blocks before `end`. `states` are the
    /// states after the first sample of block `from`, including that sample.
    fn go_back(
        &self,
        passed: &ForwardPass,
        from: usize,
        end: usize,
        states: &mut [ComplexLanes],
        rows: &mut OutputRows,
    ) {
        let (signals, count) = (rows.output.ncols(), self.groups.len());
        for block in (passed.first_block.max(rows.requested_rows.start)..from).rev() {
            let row = rows.row_of(block).filter(|_| block < end);
            let first = (block - passed.first_block) * signals;
            with_vector_instructions(
                #[inline(always)]
                || {
                    let returns =
                        passed.backward_contributions[first * count..].chunks_exact(count);
                    let samples = passed.first_samples[first..].iter();
                    let of_signals = samples.zip(states.chunks_exact_mut(count)).zip(returns);
                    for (signal, ((sample, states), returns)) in of_signals.enumerate() {
                        let (mut filtered, mut difference) = (0.0, 0.0);
                        for ((of, state), back) in self.groups.iter().zip(states).zip(returns) {
                            *state = of.pole_power.product(state).sum_with(back);
                            filtered += of.amplitude.dot(state);
                            difference += of.slope.dot(state);
                            *state = state.step(&of.pole, *sample);
                        }
                        if let Some(row) = row {
                            rows.add_output(row, signal, [filtered, -difference]);
                        }
                    }
                },
            );
        }
    }

    /// Returns the states after the continuation before the first sample. The continuation is the
    /// mirror image of the samples after it. Before the continuation, its first value is constant.
    fn initial_states(&self, samples: &[f64], padding: usize) -> Vec<ComplexLanes> {
        let before = |k: usize| 2.0 * samples[0] - samples[k];
        let level = before(padding);
        let settled: Vec<_> =
            self.modes.modes.iter().map(|mode| mode.settled_state() * level).collect();
        let states = settled.chunks(WIDTH).zip(&self.groups).map(|(settled, of)| {
            let after = |state: ComplexLanes, k| state.step(&of.pole, before(k));
            (1..=padding).rev().fold(ComplexLanes::from_numbers(settled), after)
        });
        states.collect()
    }

    /// Filters the last samples and their mirrored continuation to its end, and back to the first
    /// of them. It calls `add` with the position of each sample and the contributions of either
    /// pass to it and to the difference between its neighbours. `before` is the sample before the
    /// first.
    fn filter_end(
        &self,
        before: f64,
        samples: &[f64],
        padding: usize,
        states: &mut [ComplexLanes],
        add: &mut impl FnMut(usize, [f64; 2]),
    ) {
        let last = samples.len() - 1;
        let mirrored = (1..=padding).map(|k| 2.0 * samples[last] - samples[last - k]);
        let continued: Vec<f64> = samples.iter().copied().chain(mirrored).collect();
        let numbers = |states: &[ComplexLanes]| -> Vec<_> {
            states.iter().flat_map(ComplexLanes::numbers).collect()
        };
        let shares = |states: &[ComplexLanes]| {
            let states = self.groups.iter().zip(states);
            states.fold([0.0, 0.0], |[value, difference], (of, state)| {
                [value + of.amplitude.dot(state), difference + of.slope.dot(state)]
            })
        };
        let (mut latest, mut before) = (0.0, before);
        for (position, &sample) in continued.iter().enumerate() {
            let [value, difference] = shares(states);
            let after = continued.get(position + 1).unwrap_or(&sample);
            let difference = self.flank_gain * (after - before) + difference;
            add(position, [self.modes.centre_gain * sample + value, difference]);
            before = sample;
            if position + 1 == continued.len() {
                latest = self.modes.one_pass_output(sample, &numbers(states));
            }
            for (of, state) in self.groups.iter().zip(&mut *states) {
                *state = state.step(&of.pole, sample);
            }
        }
        let initial = self.modes.backward_states(latest, &numbers(states));
        for (state, initial) in states.iter_mut().zip(initial.chunks(WIDTH)) {
            *state = ComplexLanes::from_numbers(initial);
        }
        for (position, &sample) in continued.iter().enumerate().rev() {
            let [value, difference] = shares(states);
            add(position, [value, -difference]);
            for (of, state) in self.groups.iter().zip(&mut *states) {
                *state = state.step(&of.pole, sample);
            }
        }
    }
}

/// Results of the requested blocks.
struct OutputRows {
    output: DMatrix<f64>,
    /// Without columns unless requested.
    differences: DMatrix<f64>,
    requested_rows: Range<usize>,
}

impl OutputRows {
    /// Returns the row of a block, if it is wanted.
    fn row_of(&self, block: usize) -> Option<usize> {
        self.requested_rows.contains(&block).then(|| block - self.requested_rows.start)
    }

    #[inline(always)]
    fn add_output(&mut self, row: usize, signal: usize, [filtered, difference]: [f64; 2]) {
        self.output[(row, signal)] += filtered;
        if signal < self.differences.ncols() {
            self.differences[(row, signal)] += difference;
        }
    }
}

/// Blocks that the forward pass has processed and the backward pass has not.
struct ForwardPass {
    /// First of these blocks.
    first_block: usize,
    /// First sample of each block, unfiltered, and the contribution of its other samples to the
    /// backward pass.
    first_samples: Vec<f64>,
    backward_contributions: Vec<ComplexLanes>,
}

impl ForwardPass {
    /// `samples` is the number of first samples, `count` that of the groups of modes.
    fn with_capacity(samples: usize, count: usize) -> Self {
        Self {
            first_block: 0,
            first_samples: Vec::with_capacity(samples),
            backward_contributions: Vec::with_capacity(samples * count),
        }
    }

    fn forget_before(&mut self, block: usize, signals: usize, count: usize) {
        let done = (block - self.first_block) * signals;
        self.first_samples.drain(..done);
        self.backward_contributions.drain(..done * count);
        self.first_block = block;
    }
}
