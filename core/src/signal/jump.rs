//! Zero-phase filtering of many signals of which few samples are wanted: the filter in its parallel form, by
//! partial fractions (Oppenheim & Schafer, *Discrete-Time Signal Processing*, section 6.3.3), evaluated at
//! the decimated rate.
//!
//! Forward and backward, a filter is a sum of oscillations that fade to both sides. What one of them
//! has of the samples before a wanted one turns and fades to the next wanted one, and the samples
//! between add their sum with fixed weights; and so from the other side. The weights of both sides
//! are mirrored, so that sums and differences of mirrored samples need half of the products.

use core::ops::Range;

use nalgebra::{Complex, DMatrix};

use super::error::SignalError;
use super::modes::{Mode, Modes};
use super::record::Record;
use super::sections::SecondOrderSections;
use crate::numeric::{Lanes, Scalar, WIDTH, vectorised};

/// Oscillations that are computed side by side.
const TOGETHER: usize = WIDTH;

type Four = Lanes<TOGETHER>;

/// Complex numbers of oscillations side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    re: Four,
    im: Four,
}

impl Side {
    const ZERO: Self = Self { re: Lanes([0.0; TOGETHER]), im: Lanes([0.0; TOGETHER]) };

    fn of(numbers: &[Complex<f64>]) -> Self {
        let at = |l: usize| numbers.get(l).copied().unwrap_or_default();
        Self { re: Lanes::from_fn(|l| at(l).re), im: Lanes::from_fn(|l| at(l).im) }
    }

    fn numbers(&self) -> impl Iterator<Item = Complex<f64>> {
        self.re.0.into_iter().zip(self.im.0).map(|(re, im)| Complex::new(re, im))
    }

    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }

    #[inline(always)]
    fn scaled(&self, factor: Four) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }

    /// Real part of the sum of the products.
    #[inline(always)]
    fn dot(&self, other: &Self) -> f64 {
        sum(self.re * other.re - self.im * other.im)
    }

    /// An oscillation over one more sample: p z + x.
    #[inline(always)]
    fn step(&self, pole: &Self, sample: f64) -> Self {
        let Self { re, im } = self.times(pole);
        Self { re: re + Lanes::constant(sample), im }
    }
}

#[inline(always)]
fn sum(Lanes(x): Four) -> f64 {
    (x[0] + x[2]) + (x[1] + x[3])
}

/// Weights of a sample and its mirrored one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weights {
    /// ½ (p^i + p^(n−1−i)), of their sum.
    sum: Side,
    /// ½ (p^(n−1−i) − p^i), of their difference.
    difference: Side,
}

/// Some of a filter's oscillations over n samples between two wanted ones.
#[derive(Clone, Debug, PartialEq)]
struct Oscillations {
    pole: Side,
    /// pⁿ.
    over: Side,
    /// What a real signal makes of both passes' amplitude.
    share: Side,
    /// The same of the difference between the samples after and before: p − 1/p times the share.
    slope: Side,
    /// Of the first half of the samples.
    weights: Vec<Weights>,
}

impl Oscillations {
    fn new(modes: &[Mode], samples: usize) -> Self {
        let powers = |mode: &Mode| -> Vec<Complex<f64>> {
            let first = Complex::from(1.0);
            let powers = core::iter::successors(Some(first), |power| Some(power * mode.pole));
            powers.take(samples + 1).collect()
        };
        let powers: Vec<_> = modes.iter().map(powers).collect();
        let weights = |i: usize| {
            let mirror = samples - 1 - i;
            // A sample in the middle is its own mirror.
            let half = if i == mirror { 0.25 } else { 0.5 };
            let side = |sign: f64| -> Side {
                let of = |powers: &Vec<Complex<f64>>| (powers[mirror] + powers[i] * sign) * half;
                Side::of(&powers.iter().map(of).collect::<Vec<_>>())
            };
            Weights { sum: side(1.0), difference: side(-1.0) }
        };
        Self {
            pole: Side::of(&modes.iter().map(|mode| mode.pole).collect::<Vec<_>>()),
            over: Side::of(&powers.iter().map(|powers| powers[samples]).collect::<Vec<_>>()),
            share: Side::of(&modes.iter().map(Mode::share).collect::<Vec<_>>()),
            slope: Side::of(
                &modes.iter().map(|mode| mode.share() * mode.step_across()).collect::<Vec<_>>(),
            ),
            weights: (0..samples.div_ceil(2)).map(weights).collect(),
        }
    }

    /// `Σ p^(n−1−i) x_i` and `Σ p^i x_i` over the n samples x.
    #[inline(always)]
    fn sums(&self, samples: &[f64]) -> [Side; 2] {
        let (mut even, mut odd) = (Side::ZERO, Side::ZERO);
        for ((weights, front), back) in self.weights.iter().zip(samples).zip(samples.iter().rev()) {
            let (front, back) = (Lanes::constant(*front), Lanes::constant(*back));
            even = even.plus(&weights.sum.scaled(front + back));
            odd = odd.plus(&weights.difference.scaled(front - back));
        }
        [even.plus(&odd), even.minus(&odd)]
    }
}

/// A filter that goes forward and backward from one wanted sample to the next.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Jump {
    modes: Modes,
    flank: f64,
    /// Samples between.
    samples: usize,
    oscillations: Vec<Oscillations>,
}

impl Jump {
    /// Over so many samples.
    pub(super) fn over(filter: &SecondOrderSections, samples: usize) -> Self {
        let modes = Modes::of(filter);
        let groups = modes.modes.chunks(TOGETHER);
        let oscillations = groups.map(|modes| Oscillations::new(modes, samples)).collect();
        Self { flank: modes.flank(), modes, samples, oscillations }
    }

    /// Samples that a stretch of a record has to have room for: a jump, or what is left at the end.
    pub(super) fn room(&self, padding: usize) -> usize {
        self.samples + 1 + padding + 1
    }

    /// Filters the signals of a record as [`SecondOrderSections::filter_zero_phase`] does and gives
    /// one sample after each jump: the `wanted` ones (so many × signals), which are in the record. Of
    /// each, also the filtered sample after it less the one before.
    ///
    /// ```text
    /// S_k = Σ p^(m−1) x_(k−m)    B_k = Σ p^(m−1) x_(k+m)    y_k = g_0 x_k + Σ c (S_k + B_k)
    /// S_(k+1) = p S_k + x_k      S_(k−1) = (S_k − x_(k−1))/p
    /// y_(k+1) − y_(k−1) = (g_0 − Σ c/p) (x_(k+1) − x_(k−1)) + Σ c (p − 1/p) (S_k − B_k)
    /// ```
    ///
    /// For the time it takes, it has what the oscillations sum up in memory, for each of them.
    ///
    /// # Errors
    /// [`SignalError::NotFinite`] as for one signal.
    pub(super) fn filter_zero_phase(
        &self,
        mut record: Record<'_>,
        wanted: Range<usize>,
    ) -> Result<[DMatrix<f64>; 2], SignalError> {
        let (factor, count) = (self.samples + 1, self.oscillations.len());
        // The last jump leaves what the continuation is the mirror image of.
        let jumps = (record.samples - record.padding - 1) / factor;
        record.advance(0, record.padding + 1);
        let starts = record.stretches().flat_map(|signal| self.start(signal, record.padding));
        let mut states: Vec<Side> = starts.collect();
        // The sample before the next one; the first comes from the continuation.
        let mut before: Vec<f64> = record.stretches().map(|x| 2.0 * x[0] - x[1]).collect();

        let mut kept = DMatrix::zeros(wanted.len(), record.signals);
        let mut differences = DMatrix::zeros(wanted.len(), record.signals);
        // The unfiltered samples before each jump, and what the jump adds on the way back.
        let mut unfiltered = vec![0.0; jumps * record.signals];
        let mut returns = vec![Side::ZERO; jumps * record.signals * count];
        for jump in 0..jumps {
            record.advance(jump * factor, factor + 1);
            let mut finite = true;
            let row = jump.checked_sub(wanted.start).filter(|row| *row < wanted.len());
            vectorised(
                #[inline(always)]
                || {
                    let signals = record.stretches().zip(states.chunks_exact_mut(count));
                    let first = jump * record.signals;
                    let returns = returns[first * count..].chunks_exact_mut(count);
                    let unfiltered = &mut unfiltered[first..];
                    for ((signal, (values, states)), returns) in signals.enumerate().zip(returns) {
                        let sample = values[0];
                        let mut filtered = self.modes.centre * sample;
                        let mut difference = self.flank * (values[1] - before[signal]);
                        for ((of, state), back) in self.oscillations.iter().zip(states).zip(returns)
                        {
                            filtered += of.share.dot(state);
                            difference += of.slope.dot(state);
                            let [sums, mirrored] = of.sums(&values[1..factor]);
                            *state = of.over.times(&state.step(&of.pole, sample)).plus(&sums);
                            *back = mirrored;
                            // No weight hides what is not finite.
                            finite &= sums.re.0[0].is_finite();
                        }
                        unfiltered[signal] = sample;
                        before[signal] = values[factor - 1];
                        if let Some(row) = row {
                            kept[(row, signal)] = filtered;
                            differences[(row, signal)] = difference;
                        }
                        finite &= sample.is_finite();
                    }
                },
            );
            if !finite {
                record.check_finite(factor)?;
            }
        }

        let left = record.samples - jumps * factor;
        record.advance(jumps * factor, left);
        record.check_finite(left)?;
        let signals = record.stretches().zip(states.chunks_exact_mut(count));
        for (signal, (values, states)) in signals.enumerate() {
            let values = &values[..left];
            let (mut kept, mut differences) =
                (kept.column_mut(signal), differences.column_mut(signal));
            let mut row_of = |position: usize, [filtered, difference]: [f64; 2]| {
                let row = (jumps + position / factor).checked_sub(wanted.start);
                let row = row.filter(|_| position.is_multiple_of(factor) && position < left);
                if let Some(row) = row.filter(|row| *row < wanted.len()) {
                    kept[row] += filtered;
                    differences[row] += difference;
                }
            };
            self.turn(before[signal], values, record.padding, states, &mut row_of);
        }
        // `states` have the sample before them, which the jump adds to what is behind it.
        for jump in (wanted.start..jumps).rev() {
            let first = jump * record.signals;
            let row = jump - wanted.start;
            let mut rows =
                (row < wanted.len()).then(|| (kept.row_mut(row), differences.row_mut(row)));
            vectorised(
                #[inline(always)]
                || {
                    let returns = returns[first * count..].chunks_exact(count);
                    let signals = unfiltered[first..].iter().zip(states.chunks_exact_mut(count));
                    for (signal, ((sample, states), returns)) in signals.zip(returns).enumerate() {
                        let (mut filtered, mut difference) = (0.0, 0.0);
                        for ((of, state), back) in self.oscillations.iter().zip(states).zip(returns)
                        {
                            *state = of.over.times(state).plus(back);
                            filtered += of.share.dot(state);
                            difference += of.slope.dot(state);
                            *state = state.step(&of.pole, *sample);
                        }
                        if let Some((kept, differences)) = &mut rows {
                            kept[signal] += filtered;
                            differences[signal] -= difference;
                        }
                    }
                },
            );
        }
        Ok([kept, differences])
    }

    /// What the oscillations have of the continuation before the first sample, the mirror image of
    /// those after it, and of its first value for ever before.
    fn start(&self, samples: &[f64], padding: usize) -> Vec<Side> {
        let before = |k: usize| 2.0 * samples[0] - samples[k];
        let level = before(padding);
        let settled: Vec<_> = self.modes.modes.iter().map(|mode| mode.settled() * level).collect();
        let states = settled.chunks(TOGETHER).zip(&self.oscillations).map(|(settled, of)| {
            let after = |state: Side, k| state.step(&of.pole, before(k));
            (1..=padding).rev().fold(Side::of(settled), after)
        });
        states.collect()
    }

    /// Goes over the last samples and their mirrored continuation to its end, and back to the first
    /// of them. Calls `add` with the position of each sample, and what either pass makes of it and of
    /// the difference between the samples beside it. `before` is the sample before the first.
    fn turn(
        &self,
        before: f64,
        samples: &[f64],
        padding: usize,
        states: &mut [Side],
        add: &mut impl FnMut(usize, [f64; 2]),
    ) {
        let last = samples.len() - 1;
        let mirrored = (1..=padding).map(|k| 2.0 * samples[last] - samples[last - k]);
        let continued: Vec<f64> = samples.iter().copied().chain(mirrored).collect();
        let numbers =
            |states: &[Side]| -> Vec<_> { states.iter().flat_map(Side::numbers).collect() };
        let shares = |states: &[Side]| {
            let states = self.oscillations.iter().zip(states);
            states.fold([0.0, 0.0], |[value, difference], (of, state)| {
                [value + of.share.dot(state), difference + of.slope.dot(state)]
            })
        };
        let (mut held, mut before) = (0.0, before);
        for (position, &sample) in continued.iter().enumerate() {
            let [value, difference] = shares(states);
            let after = continued.get(position + 1).unwrap_or(&sample);
            let difference = self.flank * (after - before) + difference;
            add(position, [self.modes.centre * sample + value, difference]);
            before = sample;
            if position + 1 == continued.len() {
                held = self.modes.forward(sample, &numbers(states));
            }
            for (of, state) in self.oscillations.iter().zip(&mut *states) {
                *state = state.step(&of.pole, sample);
            }
        }
        let turned = self.modes.turned(held, &numbers(states));
        for (state, turned) in states.iter_mut().zip(turned.chunks(TOGETHER)) {
            *state = Side::of(turned);
        }
        for (position, &sample) in continued.iter().enumerate().rev() {
            let [value, difference] = shares(states);
            add(position, [value, -difference]);
            for (of, state) in self.oscillations.iter().zip(&mut *states) {
                *state = state.step(&of.pole, sample);
            }
        }
    }
}
