//! Standard deviations that are right although the residuals are not white.
//!
//! Equation 10 takes the errors of the rows for independent. They are not: the parallel filter cuts
//! below the Nyquist frequency of the rows, torque noise has a colour of its own, and so has what
//! the model does not describe. Here the errors of each joint are a stationary process. Its power
//! spectrum is that of white noise behind the filter, times a smooth shape that the residuals tell.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::fourier::{Fourier, SIGNALS};
use super::ljung_box::LjungBox;
use super::observations::Observations;
use super::products::symmetric_product;
use super::spectrum_shape::{Band, SmoothSpectrum};
use crate::numeric::vectorised;

/// Of a frequency, the share that the parameters may take out of the residuals and still leave
/// something to judge by.
const MOST_EXPLAINED: f64 = 0.9;

/// So many frequencies are multiplied at a time, which bounds the memory.
const BLOCK: usize = 8192;

/// The filter that the rows have passed, for records of so many rows. Frequencies are ratios of the
/// Nyquist frequency of the rows, 0 to 1.
#[derive(Clone, Debug)]
pub struct RowFilter {
    passband: f64,
    pub(super) fourier: Fourier,
    /// At each frequency of the transform, from 0 to the Nyquist frequency.
    pub(super) power: Vec<f64>,
    /// Frequencies within the passband.
    inside: usize,
    /// The passband as a band of its own, beyond which its end stands for what is outside.
    band: Band,
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

    /// The transforms of columns (r × c) with the rows of each joint together.
    pub(super) fn transforms(&self, columns: &DMatrix<f64>, joints: usize) -> Transforms {
        let (rows, frequencies) = (columns.nrows() / joints, self.fourier.frequencies());
        let mut values = DMatrix::zeros(2 * frequencies * joints, columns.ncols());
        let signals: Vec<&[f64]> =
            if rows == 0 { Vec::new() } else { columns.as_slice().chunks_exact(rows).collect() };
        let transformed = values.as_mut_slice().chunks_mut(2 * frequencies * SIGNALS);
        for (signals, to) in signals.chunks(SIGNALS).zip(transformed) {
            let transforms = self.fourier.of(signals);
            for (signal, to) in to.chunks_exact_mut(2 * frequencies).enumerate() {
                let (re, im) = to.split_at_mut(frequencies);
                for ((re, im), value) in re.iter_mut().zip(im).zip(&transforms) {
                    (*re, *im) = (value.re.0[signal], value.im.0[signal]);
                }
            }
        }
        Transforms { values, joints }
    }

    /// The transforms of one joint's rows at the frequencies that tell something, so that their products are those
    /// of the rows that the filter lets pass (Parseval).
    pub(super) fn passed(&self, rows: &Transforms) -> DMatrix<f64> {
        let (inside, frequencies) = (self.inside, self.fourier.frequencies());
        let length = self.fourier.length() as f64;
        let roots: Vec<f64> = (0..inside).map(|k| (self.multiplicity(k) / length).sqrt()).collect();
        let mut passed = DMatrix::zeros(2 * inside, rows.values.ncols());
        let parts = rows.values.as_slice().chunks_exact(frequencies);
        for (to, part) in passed.as_mut_slice().chunks_exact_mut(inside).zip(parts) {
            for (to, (value, root)) in to.iter_mut().zip(part.iter().zip(&roots)) {
                *to = value * root;
            }
        }
        passed
    }

    /// Adds, joint by joint, the share that a projection on these orthonormal columns takes out of
    /// white noise at each frequency.
    pub(super) fn add_leverage(
        &self,
        columns: &Transforms,
        rows: usize,
        leverage: &mut [Vec<f64>],
    ) {
        let count = leverage.len();
        for (signal, parts) in columns.signals().enumerate() {
            let (re, im) = parts.split_at(parts.len() / 2);
            for ((leverage, re), im) in leverage[signal % count].iter_mut().zip(re).zip(im) {
                *leverage += (re * re + im * im) / rows as f64;
            }
        }
    }

    /// No leverage yet.
    pub(super) fn no_leverage(&self, joints: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.fourier.frequencies()]; joints]
    }

    /// Frequency `k` as a ratio of the Nyquist frequency.
    fn ratio(&self, k: usize) -> f64 {
        k as f64 / (self.fourier.frequencies() - 1) as f64
    }

    /// How often frequency `k` stands in the two-sided transform.
    fn multiplicity(&self, k: usize) -> f64 {
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
    fn independent(&self, rows: usize) -> f64 {
        self.passband * rows as f64
    }
}

/// The errors ε of `y = X θ + ε` as stationary processes: a power spectrum per joint, and how much
/// the joints have in common.
#[derive(Clone, Debug)]
pub struct ResidualSpectrum<'a> {
    rows: usize,
    filter: &'a RowFilter,
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

/// The transforms of columns, at the frequencies up to Nyquist's.
#[derive(Clone, Debug)]
pub(super) struct Transforms {
    /// A column's joints one below the other, of each joint the real parts and then the imaginary
    /// ones.
    values: DMatrix<f64>,
    joints: usize,
}

impl Transforms {
    /// Real and imaginary parts of every column's joints, column by column.
    fn signals(&self) -> impl Iterator<Item = &[f64]> {
        self.values.as_slice().chunks_exact(self.values.nrows() / self.joints)
    }
}

impl<'a> ResidualSpectrum<'a> {
    /// From unweighted residuals (r) out of which a projection has taken the share `leverage` at
    /// each frequency, joint by joint.
    pub(super) fn fit(
        system: &Observations,
        leverage: &[Vec<f64>],
        residuals: &DVector<f64>,
        filter: &'a RowFilter,
    ) -> Self {
        let rows = system.rows_per_joint();
        let residuals = DMatrix::from_columns(core::slice::from_ref(residuals));
        let transforms = filter.transforms(&residuals, system.joints());
        let (mut joints, mut whitened) = (Vec::new(), Vec::new());
        for ((joint, leverage), parts) in leverage.iter().enumerate().zip(transforms.signals()) {
            let (re, im) = parts.split_at(parts.len() / 2);
            let squares = re.iter().zip(im).map(|(re, im)| re * re + im * im);
            let periodogram: Vec<f64> = squares
                .zip(leverage)
                .zip(&filter.power)
                .take(filter.inside)
                .map(|((square, leverage), filtered)| {
                    let left = 1.0 - leverage.min(MOST_EXPLAINED);
                    square / (rows as f64 * left * filtered)
                })
                .collect();
            let mut shape =
                SmoothSpectrum::fit(&filter.band, &periodogram, filter.independent(rows));
            // An exact fit leaves rounding, which is not nothing.
            let measured = system.measurements().rows_range(system.joint_rows(joint));
            let rounding = measured.norm_squared() / rows as f64 * f64::EPSILON.powi(2);
            let least = SmoothSpectrum::flat(rounding.max(f64::MIN_POSITIVE));
            if shape.at_zero() < least.at_zero() {
                shape = least;
            }
            let shape_values = shape.values(&filter.band);
            let power: Vec<f64> =
                filter.power.iter().zip(shape_values).map(|(filtered, g)| filtered * g).collect();
            let white = |parts: &[f64]| -> Vec<f64> {
                let inside = parts.iter().zip(&power).take(filter.inside);
                inside.map(|(value, power)| value / power.sqrt()).collect()
            };
            whitened.push([white(re), white(im)].concat());
            joints.push(JointSpectrum { power, autocorrelations: shape.autocorrelations });
        }
        let correlation = DMatrix::from_fn(joints.len(), joints.len(), |i, j| {
            if i == j { 1.0 } else { coherence(&whitened[i], &whitened[j]) }
        });
        Self { rows, filter, joints, correlation }
    }

    /// Covariance `ZᵀVZ` of `Zᵀε` (c × c), with Z = Ω^{-1/2} C of the columns that were transformed
    /// and these noise levels.
    pub(super) fn covariance_of(&self, columns: &Transforms, levels: &[f64]) -> DMatrix<f64> {
        // Parseval: zᵀVz = 1/2π ∫ S(ω) |Z(ω)|² dω, here over real and imaginary parts.
        let length = self.filter.fourier.length() as f64;
        let roots: Vec<Vec<f64>> = (self.joints.iter().zip(levels))
            .map(|(joint, level)| {
                let power = joint.power.iter().enumerate();
                let root = power.map(|(k, power)| {
                    (self.filter.multiplicity(k) * power / length).sqrt() / level
                });
                root.collect()
            })
            .collect();
        let frequencies = self.filter.fourier.frequencies();
        let blocks = (0..frequencies).step_by(BLOCK);
        let of_block = |from: usize| {
            let block = from..frequencies.min(from + BLOCK);
            self.product_of(columns, &roots, block)
        };
        blocks.map(of_block).reduce(|sum, of_block| sum + of_block).unwrap_or_default()
    }

    /// That of a block of frequencies, by the roots of what each joint's power weighs there.
    fn product_of(
        &self,
        columns: &Transforms,
        roots: &[Vec<f64>],
        block: Range<usize>,
    ) -> DMatrix<f64> {
        let (joints, size) = (self.joints.len(), 2 * block.len());
        let frequencies = self.filter.fourier.frequencies();
        let mut parts = DMatrix::zeros(size * joints, columns.values.ncols());
        // Every joint with what all have in common with it.
        let mut common = DMatrix::zeros(parts.nrows(), parts.ncols());
        vectorised(
            #[inline(always)]
            || {
                let signals = columns.values.as_slice().chunks_exact(2 * frequencies);
                let parts_of = parts.as_mut_slice().chunks_exact_mut(size);
                for (signal, (from, parts)) in signals.zip(parts_of).enumerate() {
                    let roots = &roots[signal % joints][block.clone()];
                    let (re, im) = from.split_at(frequencies);
                    let (to_re, to_im) = parts.split_at_mut(roots.len());
                    for (from, to) in [(re, to_re), (im, to_im)] {
                        for ((from, to), root) in from[block.clone()].iter().zip(to).zip(roots) {
                            *to = *from * root;
                        }
                    }
                }
                let columns = parts.as_slice().chunks_exact(size * joints);
                for (from, to) in columns.zip(common.as_mut_slice().chunks_exact_mut(size * joints))
                {
                    for (i, to) in to.chunks_exact_mut(size).enumerate() {
                        for (j, from) in from.chunks_exact(size).enumerate() {
                            let share = self.correlation[(i, j)];
                            for (to, from) in to.iter_mut().zip(from) {
                                *to += share * from;
                            }
                        }
                    }
                }
            },
        );
        symmetric_product(&parts, &common)
    }

    /// Multiplies the power of each joint whose errors have a smaller standard deviation than this.
    pub(super) fn raise_to(&mut self, deviations: &[f64]) {
        let length = self.filter.fourier.length() as f64;
        for (joint, deviation) in self.joints.iter_mut().zip(deviations) {
            let power = joint.power.iter().enumerate();
            let sum: f64 = power.map(|(k, power)| self.filter.multiplicity(k) * power).sum();
            let raised = deviation * deviation * length / sum;
            if raised > 1.0 {
                joint.power.iter_mut().for_each(|power| *power *= raised);
            }
        }
    }

    /// The same power of each joint, as much at each frequency that tells something.
    pub(super) fn whitened(&self) -> Self {
        let mut white = self.clone();
        for joint in 0..white.joints.len() {
            let mean = self.mean_power(joint);
            white.joints[joint].power[..self.filter.inside].fill(mean);
        }
        white
    }

    /// The mean power of a joint's errors over the frequencies that tell something.
    pub(super) fn mean_power(&self, joint: usize) -> f64 {
        let inside = &self.joints[joint].power[..self.filter.inside];
        inside.iter().sum::<f64>() / inside.len() as f64
    }

    /// Independent rows of all joints, by the filter alone: rows times the passband.
    pub(super) fn independent_rows(&self) -> f64 {
        self.filter.independent(self.rows) * self.joints.len() as f64
    }

    /// Of every joint, how many independent rows its rows are worth where a mean is formed:
    /// `N γ_0 / Σ_l γ_l`, the mean of the spectrum over its value at frequency 0.
    pub fn effective_rows_per_joint(&self) -> Vec<f64> {
        let length = self.filter.fourier.length() as f64;
        let effective = |joint: &JointSpectrum| {
            let power = joint.power.iter().enumerate();
            let variance = power.map(|(k, p)| self.filter.multiplicity(k) * p).sum::<f64>();
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

/// The real part of the coherence of two transforms, from their real and imaginary parts.
fn coherence(a: &[f64], b: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}
