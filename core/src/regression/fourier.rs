//! Fourier transforms of real signals, several at once.

use crate::numeric::{Lanes, Scalar, WIDTH, vectorised};

/// Signals side by side. Each has the bits that it would have alone.
pub(super) const SIGNALS: usize = WIDTH;

/// As many complex numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Complex {
    pub(super) re: Lanes<SIGNALS>,
    pub(super) im: Lanes<SIGNALS>,
}

impl Complex {
    const ZERO: Self = Self { re: Lanes([0.0; SIGNALS]), im: Lanes([0.0; SIGNALS]) };

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }

    #[inline(always)]
    fn rotated(self, [cos, sin]: [f64; 2]) -> Self {
        let (cos, sin) = (Lanes::constant(cos), Lanes::constant(sin));
        Self { re: self.re * cos - self.im * sin, im: self.re * sin + self.im * cos }
    }
}

/// The transform `Σ_k x_k e^{−jωk}` of signals of one length, a power of two.
#[derive(Clone, Debug)]
pub(super) struct Fourier {
    length: usize,
    /// `[cos, −sin]` of 2π k/length over half a turn.
    turns: Vec<[f64; 2]>,
}

impl Fourier {
    /// For signals of at least so many values, which are continued by zeros.
    pub(super) fn for_values(values: usize) -> Self {
        let length = values.next_power_of_two().max(2);
        let angle = |k: usize| 2.0 * core::f64::consts::PI * k as f64 / length as f64;
        let turn = |k| [angle(k).cos(), -angle(k).sin()];
        Self { length, turns: (0..length / 2).map(turn).collect() }
    }

    /// Values of a signal.
    pub(super) fn length(&self) -> usize {
        self.length
    }

    /// Frequencies from 0 to the Nyquist frequency, both included.
    pub(super) fn frequencies(&self) -> usize {
        self.length / 2 + 1
    }

    /// The transforms at the frequencies from 0 to Nyquist's. `signals` are not longer than the
    /// transform, and no more than [`SIGNALS`].
    pub(super) fn of(&self, signals: &[&[f64]]) -> Vec<Complex> {
        let half = self.length / 2;
        // Even values as real parts, odd ones as imaginary: a complex signal of half the length
        // (Press et al., Numerical Recipes, section 12.3).
        let mut packed = vec![Complex::ZERO; half];
        for (l, signal) in signals.iter().enumerate() {
            for (packed, values) in packed.iter_mut().zip(signal.chunks(2)) {
                packed.re.0[l] = values[0];
                packed.im.0[l] = values.get(1).copied().unwrap_or(0.0);
            }
        }
        let mut spare = vec![Complex::ZERO; half];
        vectorised(
            #[inline(always)]
            || {
                self.complex(&mut packed, &mut spare);
                self.unpacked(&packed)
            },
        )
    }

    /// The transform of half the length in place, by halves that sort themselves (Stockham; Van
    /// Loan, *Computational Frameworks for the Fast Fourier Transform*, 1992, section 1.7).
    #[inline(always)]
    fn complex(&self, signal: &mut Vec<Complex>, spare: &mut Vec<Complex>) {
        let (mut parts, mut stride) = (signal.len(), 1);
        while parts > 1 {
            let half = parts / 2;
            let (low, high) = signal.split_at(half * stride);
            let pairs = low.chunks_exact(stride).zip(high.chunks_exact(stride));
            let turns = self.turns.iter().step_by(2 * stride);
            for (((low, high), to), turn) in
                pairs.zip(spare.chunks_exact_mut(2 * stride)).zip(turns)
            {
                let (sums, differences) = to.split_at_mut(stride);
                for (((low, high), sum), difference) in
                    low.iter().zip(high).zip(sums).zip(differences)
                {
                    *sum = low.plus(*high);
                    *difference = low.minus(*high).rotated(*turn);
                }
            }
            core::mem::swap(signal, spare);
            (parts, stride) = (half, 2 * stride);
        }
    }

    /// Of the packed signal's transform Z, with E and O those of the even and odd values:
    /// Z_k = E_k + i O_k, and X_k = E_k + e^{−jω} O_k.
    #[inline(always)]
    fn unpacked(&self, packed: &[Complex]) -> Vec<Complex> {
        let half = packed.len();
        let mut transforms = Vec::with_capacity(half + 1);
        for k in 0..=half {
            let (z, mirrored) = (packed[k % half], packed[(half - k) % half]);
            let one_half = Lanes::constant(0.5);
            let even = Complex {
                re: one_half * (z.re + mirrored.re),
                im: one_half * (z.im - mirrored.im),
            };
            let odd = Complex {
                re: one_half * (z.im + mirrored.im),
                im: one_half * (mirrored.re - z.re),
            };
            // At the Nyquist frequency, half a turn.
            let turn = self.turns.get(k).copied().unwrap_or([-1.0, 0.0]);
            transforms.push(even.plus(odd.rotated(turn)));
        }
        transforms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_sum_that_it_stands_for() {
        for values in [1, 2, 3, 8, 100, 256] {
            let fourier = Fourier::for_values(values);
            let signals: Vec<Vec<f64>> = (1..=SIGNALS)
                .map(|s| (0..values).map(|k| ((k * 37 + s * 11) % 23) as f64 - 9.0).collect())
                .collect();
            let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
            let found = fourier.of(&slices);
            assert_eq!(found.len(), fourier.length() / 2 + 1);
            for (k, found) in found.iter().enumerate() {
                for (l, signal) in signals.iter().enumerate() {
                    let angle = -2.0 * core::f64::consts::PI * k as f64 / fourier.length() as f64;
                    let sum = signal.iter().enumerate().fold([0.0, 0.0], |sum, (m, x)| {
                        let (sin, cos) = (angle * m as f64).sin_cos();
                        [sum[0] + x * cos, sum[1] + x * sin]
                    });
                    let error = (found.re.0[l] - sum[0]).hypot(found.im.0[l] - sum[1]);
                    assert!(error < 1e-10, "{values} values, {k}: {error}");
                }
            }
            // Alone, each has the same bits.
            for (l, signal) in slices.iter().enumerate() {
                let alone = fourier.of(&[signal]);
                assert!(alone.iter().zip(&found).all(|(alone, found)| {
                    alone.re.0[0].to_bits() == found.re.0[l].to_bits()
                        && alone.im.0[0].to_bits() == found.im.0[l].to_bits()
                }));
            }
        }
    }
}
