//! Filter that was applied to the rows of an equation, represented by its power spectrum.

use super::fourier::{Fourier, PARALLEL_SIGNALS};
use super::spectrum_shape::PassBand;

/// Filter that was applied to the rows, for records of a given number of rows. Frequencies are
/// ratios of the Nyquist frequency of the rows, 0 to 1.
#[derive(Clone, Debug)]
pub struct RowFilter {
    passband: f64,
    pub(super) fourier: Fourier,
    /// Power at each frequency of the transform, from 0 to the Nyquist frequency.
    pub(super) power: Vec<f64>,
    /// Number of frequencies within the passband.
    pub(super) passband_frequencies: usize,
    /// Frequencies within the passband as a separate band. Its last value represents all
    /// frequencies above it.
    pub(super) band: PassBand,
}

impl RowFilter {
    /// Creates a filter with this passband. Above the passband, the spectrum of the residuals
    /// cannot be estimated. `power` is the power spectrum of white noise after the filter, relative
    /// to the noise before it.
    pub fn new(rows: usize, passband: f64, power: impl Fn(f64) -> f64) -> Self {
        // The length prevents sums over a record's rows from wrapping around.
        let fourier = Fourier::for_values(2 * rows);
        let last = fourier.frequencies() - 1;
        let ratios = || (0..=last).map(|k| k as f64 / last as f64);
        let inside = ratios().filter(|ratio| *ratio <= passband).count();
        let phases = ratios().map(|ratio| core::f64::consts::PI * (ratio / passband).min(1.0));
        let band = PassBand::new(inside, phases);
        let power = ratios().map(power).collect();
        Self { passband, fourier, power, passband_frequencies: inside, band }
    }

    /// Returns the transforms of the rows of each joint at the informative frequencies, as real and
    /// imaginary parts. At some frequencies they are complex conjugates, like the transforms of
    /// [`Fourier::of_class`].
    pub(super) fn transforms(&self, columns: &[f64], rows: usize) -> Vec<[Vec<f64>; 2]> {
        let signals: Vec<&[f64]> = columns.chunks_exact(rows.max(1)).collect();
        let none = || vec![0.0; self.passband_frequencies];
        let mut all_transforms: Vec<_> = signals.iter().map(|_| [none(), none()]).collect();
        for class in 0..self.fourier.frequency_classes() {
            for (signals, to) in
                signals.chunks(PARALLEL_SIGNALS).zip(all_transforms.chunks_mut(PARALLEL_SIGNALS))
            {
                let transforms = self.fourier.of_class(class, signals);
                let of_class = self.fourier.frequencies_of(class).zip(&transforms);
                for (frequency, value) in of_class.filter(|(k, _)| *k < self.passband_frequencies) {
                    for (signal, [re, im]) in to.iter_mut().enumerate() {
                        (re[frequency], im[frequency]) = (value.re.0[signal], value.im.0[signal]);
                    }
                }
            }
        }
        all_transforms
    }

    /// Returns zero leverage at the informative frequencies.
    pub(super) fn zero_leverage(&self, joints: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.passband_frequencies]; joints]
    }

    /// Returns frequency `k` as a ratio of the Nyquist frequency.
    fn frequency_ratio(&self, k: usize) -> f64 {
        k as f64 / (self.fourier.frequencies() - 1) as f64
    }

    /// Returns the number of times that frequency `k` occurs in the two-sided transform.
    pub(super) fn multiplicity(&self, k: usize) -> f64 {
        if k == 0 || k + 1 == self.fourier.frequencies() { 1.0 } else { 2.0 }
    }

    /// Returns the Durbin–Watson statistic of white noise after the filter: 2 (1 − r_1) for long
    /// records.
    pub fn durbin_watson_of_white_noise(&self) -> f64 {
        let (mut power, mut neighbours) = (0.0, 0.0);
        for (k, value) in self.power.iter().enumerate() {
            let share = self.multiplicity(k) * value;
            power += share;
            neighbours += share * (core::f64::consts::PI * self.frequency_ratio(k)).cos();
        }
        2.0 * (1.0 - neighbours / power)
    }

    /// Returns the number of independent values among `rows` rows.
    pub(super) fn independent_rows(&self, rows: usize) -> f64 {
        self.passband * rows as f64
    }
}
