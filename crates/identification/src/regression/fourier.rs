//! Fourier transforms of real signals, several at once.

use didim_dynamics::numeric::{Lanes, Scalar, WIDTH, with_vector_instructions};

/// Number of signals that are transformed side by side. Each has the same bits as alone.
pub(super) const PARALLEL_SIGNALS: usize = WIDTH;

/// Number of values in a class that is transformed at a time, and largest number of parts. Each
/// class goes over all values of a signal.
const AT_ONCE: usize = 8192;
const MAX_PARTS: usize = 64;

/// `PARALLEL_SIGNALS` complex numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Complex {
    pub(super) re: Lanes<PARALLEL_SIGNALS>,
    pub(super) im: Lanes<PARALLEL_SIGNALS>,
}

impl Complex {
    const ZERO: Self =
        Self { re: Lanes([0.0; PARALLEL_SIGNALS]), im: Lanes([0.0; PARALLEL_SIGNALS]) };

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

/// Transform `Σ_k x_k e^{−jωk}` of signals of one length, a power of two.
#[derive(Clone, Debug)]
pub(super) struct Fourier {
    length: usize,
    /// `[cos, −sin]` of 2π k/length over half a turn.
    twiddle_factors: Vec<[f64; 2]>,
}

impl Fourier {
    /// Creates the transform for signals of this number of values. The length is at least that,
    /// padded with zeros.
    pub(super) fn for_values(values: usize) -> Self {
        let length = values.next_power_of_two().max(2);
        let angle = |k: usize| 2.0 * core::f64::consts::PI * k as f64 / length as f64;
        let turn = |k| [angle(k).cos(), -angle(k).sin()];
        Self { length, twiddle_factors: (0..length / 2).map(turn).collect() }
    }

    /// Returns the number of values of a signal.
    pub(super) fn length(&self) -> usize {
        self.length
    }

    /// Returns the number of frequencies from 0 to the Nyquist frequency, both included.
    pub(super) fn frequencies(&self) -> usize {
        self.length / 2 + 1
    }

    /// Returns the number of classes of frequencies, which are transformed one at a time. The
    /// frequencies of a class leave the same remainder when they are divided by
    /// [`part_count`](Self::part_count), or its negative.
    pub(super) fn frequency_classes(&self) -> usize {
        self.part_count() / 2 + 1
    }

    /// Returns the number of parts of a transform, more than one if its values would take much
    /// memory.
    fn part_count(&self) -> usize {
        (self.length / AT_ONCE).clamp(1, MAX_PARTS)
    }

    /// Returns the frequencies of a class in the order of [`of_class`](Self::of_class), counted
    /// from 0 to Nyquist's. Each is in exactly one class, once.
    pub(super) fn frequencies_of(&self, class: usize) -> impl Iterator<Item = usize> + use<> {
        let (length, parts) = (self.length, self.part_count());
        let values = length / parts;
        let count = if class == 0 {
            values / 2 + 1
        } else if 2 * class == parts {
            // The others are their mirror images.
            values / 2
        } else {
            values
        };
        (0..count).map(move |k| {
            let frequency = parts * k + class;
            frequency.min(length - frequency)
        })
    }

    /// Returns the transforms at the frequencies from 0 to Nyquist's. `signals` are not longer than
    /// the transform, and at most [`PARALLEL_SIGNALS`] in number.
    pub(super) fn transform(&self, signals: &[&[f64]]) -> Vec<Complex> {
        self.of_real(signals, self.length)
    }

    /// Returns the transforms at the frequencies of a class. For a frequency beyond Nyquist's, the
    /// transform of its mirror image is the conjugate.
    ///
    /// With `N = P M` and k = P m + r, `X_k = Σ_i e^{−j2πri/N} (Σ_p x_(i+Mp) e^{−j2πrp/P})
    /// e^{−j2πmi/M}`: a transform of M values (decimation in frequency; Van Loan, section 1.9). The
    /// inner sum has one angle for each part of the signal. The signals have one length.
    pub(super) fn of_class(&self, class: usize, signals: &[&[f64]]) -> Vec<Complex> {
        let values = self.length / self.part_count();
        if class == 0 {
            return self.of_real(signals, values);
        }
        let length = signals.first().map_or(0, |signal| signal.len());
        let mut folded = vec![Complex::ZERO; values];
        with_vector_instructions(
            #[inline(always)]
            || {
                for first in (0..length).step_by(values) {
                    let [cos, sin] = self.twiddle_factor(class * first).map(Lanes::constant);
                    let end = length.min(first + values);
                    // Lanes without a signal repeat the last one.
                    let parts: [&[f64]; PARALLEL_SIGNALS] =
                        core::array::from_fn(|l| &signals[l.min(signals.len() - 1)][first..end]);
                    for (i, folded) in folded[..end - first].iter_mut().enumerate() {
                        let value = Lanes::from_fn(|l| parts[l][i]);
                        folded.re += value * cos;
                        folded.im += value * sin;
                    }
                }
                for (i, folded) in folded.iter_mut().enumerate() {
                    *folded = folded.rotated(self.twiddle_factor(class * i));
                }
                let mut spare = vec![Complex::ZERO; values];
                self.transform_complex(&mut folded, &mut spare);
            },
        );
        folded
    }

    /// Returns `[cos, −sin]` of 2π k/length.
    #[inline(always)]
    fn twiddle_factor(&self, k: usize) -> [f64; 2] {
        let (k, half) = (k % self.length, self.length / 2);
        if k < half {
            self.twiddle_factors[k]
        } else {
            self.twiddle_factors[k - half].map(|value| -value)
        }
    }

    /// Transforms real signals that repeat after this number of values. The result has that many
    /// frequencies from 0, as far up as Nyquist's.
    fn of_real(&self, signals: &[&[f64]], values: usize) -> Vec<Complex> {
        let half = values / 2;
        // Even values as real parts, odd ones as imaginary: a complex signal of half the length
        // (Press et al., Numerical Recipes, section 12.3).
        let mut packed = vec![Complex::ZERO; half];
        for (l, signal) in signals.iter().enumerate() {
            for part in signal.chunks(values) {
                for (packed, values) in packed.iter_mut().zip(part.chunks(2)) {
                    packed.re.0[l] += values[0];
                    packed.im.0[l] += values.get(1).copied().unwrap_or(0.0);
                }
            }
        }
        let mut spare = vec![Complex::ZERO; half];
        with_vector_instructions(
            #[inline(always)]
            || {
                self.transform_complex(&mut packed, &mut spare);
                self.unpack_transform(&packed)
            },
        )
    }

    /// Transforms a complex signal in place, with a power of two of values. It uses self-sorting
    /// halves (Stockham; Van Loan, *Computational Frameworks for the Fast Fourier Transform*, 1992,
    /// section 1.7).
    #[inline(always)]
    fn transform_complex(&self, signal: &mut Vec<Complex>, spare: &mut Vec<Complex>) {
        let (mut parts, mut stride) = (signal.len(), 1);
        let step = self.length / parts;
        while parts > 1 {
            let half = parts / 2;
            let (low, high) = signal.split_at(half * stride);
            let pairs = low.chunks_exact(stride).zip(high.chunks_exact(stride));
            let turns = self.twiddle_factors.iter().step_by(step * stride);
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

    /// Unpacks the packed signal's transform Z. With the transforms E and O of the even and odd
    /// values, Z_k = E_k + i O_k, and X_k = E_k + e^{−jω} O_k.
    #[inline(always)]
    fn unpack_transform(&self, packed: &[Complex]) -> Vec<Complex> {
        let half = packed.len();
        let step = self.length / (2 * half);
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
            let turn = self.twiddle_factors.get(step * k).copied().unwrap_or([-1.0, 0.0]);
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
            let signals: Vec<Vec<f64>> = (1..=PARALLEL_SIGNALS)
                .map(|s| (0..values).map(|k| ((k * 37 + s * 11) % 23) as f64 - 9.0).collect())
                .collect();
            let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
            let spectrum = fourier.transform(&slices);
            assert_eq!(spectrum.len(), fourier.length() / 2 + 1);
            for (k, found) in spectrum.iter().enumerate() {
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
            // Each signal alone has the same bits.
            for (l, signal) in slices.iter().enumerate() {
                let alone = fourier.transform(&[signal]);
                assert!(alone.iter().zip(&spectrum).all(|(alone, found)| {
                    alone.re.0[0].to_bits() == found.re.0[l].to_bits()
                        && alone.im.0[0].to_bits() == found.im.0[l].to_bits()
                }));
            }
        }
    }

    #[test]
    fn classes_have_every_frequency_once() {
        for values in [100, 3000, 9000] {
            let fourier = Fourier::for_values(values);
            let signals: Vec<Vec<f64>> = (1..=3)
                .map(|s| (0..values / 2).map(|k| ((k * 37 + s * 11) % 23) as f64 - 9.0).collect())
                .collect();
            let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
            let expected = fourier.transform(&slices);
            let mut seen = vec![0; fourier.frequencies()];
            for class in 0..fourier.frequency_classes() {
                let spectra = fourier.of_class(class, &slices);
                for (frequency, found) in fourier.frequencies_of(class).zip(&spectra) {
                    seen[frequency] += 1;
                    for l in 0..3 {
                        let [re, im] = [found.re.0[l], found.im.0[l].abs()];
                        let expected =
                            [expected[frequency].re.0[l], expected[frequency].im.0[l].abs()];
                        let error = (re - expected[0]).hypot(im - expected[1]);
                        assert!(error < 1e-9, "{values} values, {frequency}: {error}");
                    }
                }
            }
            assert!(seen.iter().all(|count| *count == 1), "{values} values");
        }
    }
}
