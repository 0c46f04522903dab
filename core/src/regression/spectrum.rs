//! Standard deviations that are right although the residuals are not white.
//!
//! Equation 10 takes the errors of the rows for independent. They are not: the parallel filter cuts
//! below the Nyquist frequency of the rows, torque noise has a colour of its own, and so has what
//! the model does not describe. Here the errors of each joint are a stationary process. Its power
//! spectrum is that of white noise behind the filter, times a smooth shape that the residuals tell.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, DVectorView};
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlannerScalar};

use super::ljung_box::LjungBox;
use super::observations::Observations;
use super::spectrum_shape::SmoothSpectrum;

/// Of a frequency, the share that the parameters may take out of the residuals and still leave
/// something to judge by.
const MOST_EXPLAINED: f64 = 0.9;

/// The filter that the rows have passed, for records of so many rows. Frequencies are ratios of the
/// Nyquist frequency of the rows, 0 to 1.
#[derive(Clone, Debug)]
pub struct RowFilter {
    passband: f64,
    pub(super) transform: Transform,
    /// At each frequency of the transform, from 0 to the Nyquist frequency.
    pub(super) power: Vec<f64>,
}

impl RowFilter {
    /// Noise passes up to `passband`; beyond, residuals tell nothing of their shape. `power` is the
    /// power spectrum of white noise behind the filter, relative to the noise before it.
    pub fn new(rows: usize, passband: f64, power: impl Fn(f64) -> f64) -> Self {
        let transform = Transform::for_rows(rows);
        let power = (0..transform.frequencies()).map(|k| power(transform.ratio(k))).collect();
        Self { passband, transform, power }
    }

    /// Frequencies within the passband.
    fn inside(&self) -> usize {
        let frequencies = 0..self.transform.frequencies();
        frequencies.filter(|&k| self.transform.ratio(k) <= self.passband).count()
    }

    /// Adds, joint by joint, the share that a projection on these orthonormal columns takes out of
    /// white noise at each frequency.
    pub(super) fn add_leverage(&self, columns: &DMatrix<f64>, leverage: &mut [Vec<f64>]) {
        let rows = columns.nrows() / leverage.len();
        for column in columns.column_iter() {
            let column: DVector<f64> = column.into_owned();
            for (joint, leverage) in leverage.iter_mut().enumerate() {
                let part = self.transform.of(column.rows(joint * rows, rows));
                for (leverage, value) in leverage.iter_mut().zip(part) {
                    *leverage += value.norm_sqr() / rows as f64;
                }
            }
        }
    }

    /// No leverage yet.
    pub(super) fn no_leverage(&self, joints: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.transform.frequencies()]; joints]
    }

    /// The Durbin–Watson statistic of white noise behind the filter, 2 (1 − r_1) in long records.
    pub fn durbin_watson_of_white_noise(&self) -> f64 {
        let (mut power, mut neighbours) = (0.0, 0.0);
        for (k, value) in self.power.iter().enumerate() {
            let share = self.transform.multiplicity(k) * value;
            power += share;
            neighbours += share * (core::f64::consts::PI * self.transform.ratio(k)).cos();
        }
        2.0 * (1.0 - neighbours / power)
    }

    /// Independent values among so many rows.
    fn independent(&self, rows: usize) -> f64 {
        self.passband * rows as f64
    }
}

/// The errors ε of `y = X θ + ε` as stationary processes: a power spectrum per joint, and how much
/// the joints have in common.
#[derive(Clone, Debug)]
pub struct ResidualSpectrum {
    rows: usize,
    filter: RowFilter,
    joints: Vec<JointSpectrum>,
    /// Correlation between the joints' errors at the same instant (n × n).
    correlation: DMatrix<f64>,
}

#[derive(Clone, Debug)]
struct JointSpectrum {
    /// Power at each frequency of the transform, from 0 to the Nyquist frequency.
    power: Vec<f64>,
    /// Autocorrelations from lag 1 when the filter's own colour is taken out.
    autocorrelations: Vec<f64>,
}

/// A Fourier transform that is long enough for sums over a record's rows not to wrap around.
#[derive(Clone)]
pub(super) struct Transform {
    fft: Arc<dyn Fft<f64>>,
}

impl core::fmt::Debug for Transform {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Transform").field("length", &self.fft.len()).finish()
    }
}

impl Transform {
    fn for_rows(rows: usize) -> Self {
        // The scalar planner: results do not depend on what the processor can do.
        Self { fft: FftPlannerScalar::new().plan_fft_forward((2 * rows).next_power_of_two()) }
    }

    /// Frequencies from 0 to the Nyquist frequency, both included.
    fn frequencies(&self) -> usize {
        self.fft.len() / 2 + 1
    }

    /// Frequency `k` as a ratio of the Nyquist frequency.
    fn ratio(&self, k: usize) -> f64 {
        k as f64 / (self.frequencies() - 1) as f64
    }

    /// How often frequency `k` stands in the two-sided transform.
    fn multiplicity(&self, k: usize) -> f64 {
        if k == 0 || k + 1 == self.frequencies() { 1.0 } else { 2.0 }
    }

    /// `Σ_k x_k e^{−jωk}/Σ_k x_k` of a two-sided sequence that is even, given by its first half.
    pub(super) fn of_even(&self, half: &[f64]) -> Vec<f64> {
        let length = self.fft.len();
        let mut buffer: Vec<Complex64> =
            (0..length).map(|k| Complex64::from(half[k.min(length - k)])).collect();
        self.fft.process(&mut buffer);
        let sum = buffer[0].re;
        buffer.iter().take(self.frequencies()).map(|value| value.re / sum).collect()
    }

    /// `Σ_k x_k e^{−jωk}` at the frequencies up to Nyquist's.
    fn of(&self, x: DVectorView<'_, f64>) -> Vec<Complex64> {
        let mut buffer = vec![Complex64::ZERO; self.fft.len()];
        for (to, from) in buffer.iter_mut().zip(x.iter()) {
            to.re = *from;
        }
        self.fft.process(&mut buffer);
        buffer.truncate(self.frequencies());
        buffer
    }
}

impl ResidualSpectrum {
    /// From unweighted residuals (r) out of which a projection has taken the share `leverage` at
    /// each frequency, joint by joint.
    pub(super) fn fit(
        system: &Observations,
        leverage: &[Vec<f64>],
        residuals: &DVector<f64>,
        filter: &RowFilter,
    ) -> Self {
        let rows = system.rows_per_joint();
        let (transform, inside) = (&filter.transform, filter.inside());
        let (mut joints, mut whitened) = (Vec::new(), Vec::new());
        for (joint, leverage) in leverage.iter().enumerate() {
            let range = system.joint_rows(joint);
            let residual = transform.of(residuals.rows_range(range.clone()));
            let periodogram: Vec<f64> =
                (residual.iter().zip(leverage).zip(&filter.power).take(inside))
                    .map(|((value, leverage), filtered)| {
                        let left = 1.0 - leverage.min(MOST_EXPLAINED);
                        value.norm_sqr() / (rows as f64 * left * filtered)
                    })
                    .collect();
            let mut shape = SmoothSpectrum::fit(&periodogram, filter.independent(rows));
            // An exact fit leaves rounding, which is not nothing.
            let rounding = system.measurements().rows_range(range).norm_squared() / rows as f64
                * f64::EPSILON.powi(2);
            let least = SmoothSpectrum::flat(rounding.max(f64::MIN_POSITIVE));
            if shape.at(0.0) < least.at(0.0) {
                shape = least;
            }
            let power: Vec<f64> = (filter.power.iter().enumerate())
                .map(|(k, filtered)| {
                    let phi =
                        core::f64::consts::PI * (transform.ratio(k) / filter.passband).min(1.0);
                    filtered * shape.at(phi)
                })
                .collect();
            let white: Vec<Complex64> = residual
                .iter()
                .zip(&power)
                .take(inside)
                .map(|(value, power)| value / power.sqrt())
                .collect();
            whitened.push(white);
            joints.push(JointSpectrum { power, autocorrelations: shape.autocorrelations });
        }
        let correlation = DMatrix::from_fn(joints.len(), joints.len(), |i, j| {
            if i == j { 1.0 } else { coherence(&whitened[i], &whitened[j]) }
        });
        Self { rows, filter: filter.clone(), joints, correlation }
    }

    /// Covariance `ZᵀVZ` of `Zᵀε` (c × c); Z is r × c with the rows of each joint together.
    pub(super) fn covariance_of(&self, z: &DMatrix<f64>) -> DMatrix<f64> {
        // Parseval: zᵀVz = 1/2π ∫ S(ω) |Z(ω)|² dω, here over real and imaginary parts.
        let length = self.filter.transform.fft.len() as f64;
        let transform = &self.filter.transform;
        let frequencies = transform.frequencies();
        let parts: Vec<DMatrix<f64>> = (self.joints.iter().enumerate())
            .map(|(joint, spectrum)| {
                let mut part = DMatrix::zeros(2 * frequencies, z.ncols());
                for (c, mut to) in part.column_iter_mut().enumerate() {
                    let column: DVector<f64> =
                        z.view((joint * self.rows, c), (self.rows, 1)).column(0).into_owned();
                    for (k, value) in self.filter.transform.of(column.as_view()).iter().enumerate()
                    {
                        let power =
                            self.filter.transform.multiplicity(k) * spectrum.power[k] / length;
                        to[2 * k] = power.sqrt() * value.re;
                        to[2 * k + 1] = power.sqrt() * value.im;
                    }
                }
                part
            })
            .collect();
        let mut covariance = DMatrix::zeros(z.ncols(), z.ncols());
        for (i, first) in parts.iter().enumerate() {
            covariance += first.tr_mul(first);
            for (j, second) in parts.iter().enumerate().skip(i + 1) {
                let product = first.tr_mul(second) * self.correlation[(i, j)];
                covariance += &product;
                covariance += product.transpose();
            }
        }
        covariance
    }

    /// Independent rows of all joints, by the filter alone: rows times the passband.
    pub(super) fn independent_rows(&self) -> f64 {
        self.filter.independent(self.rows) * self.joints.len() as f64
    }

    /// Of every joint, how many independent rows its rows are worth where a mean is formed:
    /// `N γ_0 / Σ_l γ_l`, the mean of the spectrum over its value at frequency 0.
    pub fn effective_rows_per_joint(&self) -> Vec<f64> {
        let length = self.filter.transform.fft.len() as f64;
        let effective = |joint: &JointSpectrum| {
            let power = joint.power.iter().enumerate();
            let variance =
                power.map(|(k, p)| self.filter.transform.multiplicity(k) * p).sum::<f64>();
            self.rows as f64 * variance / length / joint.power[0]
        };
        self.joints.iter().map(effective).collect()
    }

    /// Of every joint, the test for whiteness: of the autocorrelations that remain when the filter's
    /// own colour is taken out, over as many independent samples as rows times the passband.
    pub fn ljung_box_per_joint(&self) -> Vec<LjungBox> {
        let samples = self.filter.independent(self.rows);
        self.joints.iter().map(|joint| LjungBox::of(&joint.autocorrelations, samples)).collect()
    }
}

/// The real part of the coherence of two transforms.
fn coherence(a: &[Complex64], b: &[Complex64]) -> f64 {
    let power = |x: &[Complex64]| x.iter().map(Complex64::norm_sqr).sum::<f64>();
    let common: f64 = a.iter().zip(b).map(|(a, b)| (a.conj() * b).re).sum();
    let size = (power(a) * power(b)).sqrt();
    if size > 0.0 { common / size } else { 0.0 }
}
