//! Modes of a filter in the lanes of vector instructions, and their sums over a block of samples.

use nalgebra::Complex;

use super::complex_lanes::ComplexLanes;
use super::modes::Mode;
use didim_dynamics::numeric::{Lanes, Scalar};

/// Weights of a sample and its mirrored sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weights {
    /// ½ (p^i + p^(n−1−i)), the weight of their sum.
    of_sum: ComplexLanes,
    /// ½ (p^(n−1−i) − p^i), the weight of their difference.
    of_difference: ComplexLanes,
}

/// Group of a filter's modes, over n samples.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ModeGroup {
    pub(super) pole: ComplexLanes,
    /// Power pⁿ of the pole.
    pub(super) pole_power: ComplexLanes,
    /// Contribution of the two-pass amplitude to a real signal.
    pub(super) amplitude: ComplexLanes,
    /// The same contribution to the difference between the next and the previous sample: (p − 1/p)
    /// times the amplitude.
    pub(super) slope: ComplexLanes,
    /// Weights of the first half of the samples.
    weights: Vec<Weights>,
}

impl ModeGroup {
    pub(super) fn new(modes: &[Mode], samples: usize) -> Self {
        let powers = |mode: &Mode| -> Vec<Complex<f64>> {
            let first = Complex::from(1.0);
            let powers = core::iter::successors(Some(first), |power| Some(power * mode.pole));
            powers.take(samples + 1).collect()
        };
        let powers: Vec<_> = modes.iter().map(powers).collect();
        let weights = |i: usize| {
            let mirror = samples - 1 - i;
            // A sample in the middle is its own mirror image.
            let half = if i == mirror { 0.25 } else { 0.5 };
            let side = |sign: f64| -> ComplexLanes {
                let lanes_of =
                    |powers: &Vec<Complex<f64>>| (powers[mirror] + powers[i] * sign) * half;
                ComplexLanes::from_numbers(&powers.iter().map(lanes_of).collect::<Vec<_>>())
            };
            Weights { of_sum: side(1.0), of_difference: side(-1.0) }
        };
        Self {
            pole: ComplexLanes::from_numbers(
                &modes.iter().map(|mode| mode.pole).collect::<Vec<_>>(),
            ),
            pole_power: ComplexLanes::from_numbers(
                &powers.iter().map(|powers| powers[samples]).collect::<Vec<_>>(),
            ),
            amplitude: ComplexLanes::from_numbers(
                &modes.iter().map(Mode::real_amplitude).collect::<Vec<_>>(),
            ),
            slope: ComplexLanes::from_numbers(
                &modes
                    .iter()
                    .map(|mode| mode.real_amplitude() * mode.step_across())
                    .collect::<Vec<_>>(),
            ),
            weights: (0..samples.div_ceil(2)).map(weights).collect(),
        }
    }

    /// Returns `Σ p^(n−1−i) x_i` and `Σ p^i x_i` over the n samples x.
    #[inline(always)]
    pub(super) fn power_sums(&self, samples: &[f64]) -> [ComplexLanes; 2] {
        let (mut even, mut odd) = (ComplexLanes::ZERO, ComplexLanes::ZERO);
        for ((weights, front), back) in self.weights.iter().zip(samples).zip(samples.iter().rev()) {
            let (front, back) = (Lanes::constant(*front), Lanes::constant(*back));
            even = even.sum_with(&weights.of_sum.scaled(front + back));
            odd = odd.sum_with(&weights.of_difference.scaled(front - back));
        }
        [even.sum_with(&odd), even.difference_from(&odd)]
    }
}
