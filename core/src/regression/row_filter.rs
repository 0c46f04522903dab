//! The filter that the rows of an equation have passed, as their spectra need it.

use super::fourier::{Fourier, SIGNALS};
use super::spectrum_shape::Band;

/// The filter that the rows have passed, for records of so many rows. Frequencies are ratios of the
/// Nyquist frequency of the rows, 0 to 1.
#[derive(Clone, Debug)]
pub struct RowFilter {
    passband: f64,
    pub(super) fourier: Fourier,
    /// At each frequency of the transform, from 0 to the Nyquist frequency.
    pub(super) power: Vec<f64>,
    /// Frequencies within the passband.
    pub(super) inside: usize,
    /// The passband as a band of its own, beyond which its end stands for what is outside.
    pub(super) band: Band,
}

impl RowFilter {
    /// Noise passes up to `passband`; beyond, residuals tell nothing of their shape. `power` is the
    /// power spectrum of white noise behind the filter, relative to the noise before it.
    pub fn new(rows: usize, passband: f64, power: impl Fn(f64) -> f64) -> Self {
        // Long enough for sums over a record's rows not to wrap around.
        let fourier = Fourier::for_values(2 * rows);
        let last = fourier.frequencies() - 1;
        let ratios = || (0..=last).map(|k| k as f64 / last as f64);
        let inside = ratios().filter(|ratio| *ratio <= passband).count();
        let phases = ratios().map(|ratio| core::f64::consts::PI * (ratio / passband).min(1.0));
        let band = Band::new(inside, phases);
        let power = ratios().map(power).collect();
        Self { passband, fourier, power, inside, band }
    }

    /// The transforms of the rows of each joint, so many, at the frequencies that tell something: real and imaginary parts,
    /// of some frequencies the conjugate (those of [`Fourier::of_class`]).
    pub(super) fn transforms(&self, columns: &[f64], rows: usize) -> Vec<[Vec<f64>; 2]> {
        let signals: Vec<&[f64]> = columns.chunks_exact(rows.max(1)).collect();
        let none = || vec![0.0; self.inside];
        let mut all: Vec<_> = signals.iter().map(|_| [none(), none()]).collect();
        for class in 0..self.fourier.classes() {
            for (signals, to) in signals.chunks(SIGNALS).zip(all.chunks_mut(SIGNALS)) {
                let transforms = self.fourier.of_class(class, signals);
                let of_class = self.fourier.frequencies_of(class).zip(&transforms);
                for (frequency, value) in of_class.filter(|(k, _)| *k < self.inside) {
                    for (signal, [re, im]) in to.iter_mut().enumerate() {
                        (re[frequency], im[frequency]) = (value.re.0[signal], value.im.0[signal]);
                    }
                }
            }
        }
        all
    }

    /// No leverage yet, at the frequencies that tell something.
    pub(super) fn no_leverage(&self, joints: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.inside]; joints]
    }

    /// Frequency `k` as a ratio of the Nyquist frequency.
    fn ratio(&self, k: usize) -> f64 {
        k as f64 / (self.fourier.frequencies() - 1) as f64
    }

    /// How often frequency `k` stands in the two-sided transform.
    pub(super) fn multiplicity(&self, k: usize) -> f64 {
        if k == 0 || k + 1 == self.fourier.frequencies() { 1.0 } else { 2.0 }
    }

    /// The Durbin–Watson statistic of white noise behind the filter, 2 (1 − r_1) in long records.
    pub fn durbin_watson_of_white_noise(&self) -> f64 {
        let (mut power, mut neighbours) = (0.0, 0.0);
        for (k, value) in self.power.iter().enumerate() {
            let share = self.multiplicity(k) * value;
            power += share;
            neighbours += share * (core::f64::consts::PI * self.ratio(k)).cos();
        }
        2.0 * (1.0 - neighbours / power)
    }

    /// Independent values among so many rows.
    pub(super) fn independent(&self, rows: usize) -> f64 {
        self.passband * rows as f64
    }
}
