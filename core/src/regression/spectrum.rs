//! Standard deviations that are right although the residuals are not white.
//!
//! Equation 10 takes the errors of the rows for independent. They are not: the parallel filter cuts
//! below the Nyquist frequency of the rows, torque noise has a colour of its own, and so has what
//! the model does not describe. Here the errors of each joint are a stationary process. Its power
//! spectrum is that of white noise behind the filter, times a smooth shape that the residuals tell.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::ljung_box::LjungBox;
use super::observations::Observations;
use super::products::symmetric_product;
use super::row_filter::RowFilter;
use super::spectra::{Block, Spectra};
use super::spectrum_shape::SmoothSpectrum;
use crate::numeric::vectorised;

/// Of a frequency, the share that the parameters may take out of the residuals and still leave
/// something to judge by.
const MOST_EXPLAINED: f64 = 0.9;

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
    /// Power at each frequency of the transform, from 0 to the Nyquist frequency, but for the factor: what differs by
    /// a factor only has it in common.
    shape: Arc<[f64]>,
    factor: f64,
    /// The power at the frequencies that tell something, where it is the same at all of them.
    flat: Option<f64>,
    /// Autocorrelations from lag 1 when the filter's own colour is taken out.
    autocorrelations: Vec<f64>,
}

impl JointSpectrum {
    /// The power at a frequency, of which the first `inside` tell something.
    fn power(&self, frequency: usize, inside: usize) -> f64 {
        match self.flat {
            Some(power) if frequency < inside => power,
            _ => self.factor * self.shape[frequency],
        }
    }

    /// The power of all frequencies, mirror images included.
    fn total(&self, filter: &RowFilter) -> f64 {
        let power = (0..self.shape.len()).map(|k| (k, self.power(k, filter.inside)));
        power.map(|(k, power)| filter.multiplicity(k) * power).sum()
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
        let (mut joints, mut whitened) = (Vec::new(), Vec::new());
        let transforms = filter.transforms(residuals.as_slice(), rows);
        for ((joint, leverage), mut parts) in leverage.iter().enumerate().zip(transforms) {
            let [re, im] = &parts;
            let squares = re.iter().zip(im).map(|(re, im)| re * re + im * im);
            let periodogram: Vec<f64> = squares
                .zip(leverage)
                .zip(&filter.power)
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
            let power: Arc<[f64]> =
                filter.power.iter().zip(shape_values).map(|(filtered, g)| filtered * g).collect();
            for part in &mut parts {
                part.iter_mut().zip(&*power).for_each(|(value, power)| *value /= power.sqrt());
            }
            whitened.push(parts);
            let autocorrelations = shape.autocorrelations;
            joints.push(JointSpectrum { shape: power, factor: 1.0, flat: None, autocorrelations });
        }
        let correlation = DMatrix::from_fn(joints.len(), joints.len(), |i, j| {
            if i == j { 1.0 } else { coherence(&whitened[i], &whitened[j]) }
        });
        Self { rows, filter, joints, correlation }
    }

    /// Covariance `ZᵀVZ` of `Zᵀε` (c × c), with Z = Ω^{-1/2} C of the columns that were transformed
    /// and these noise levels.
    pub(super) fn covariance_of(&self, columns: &Spectra<'_>, levels: &[f64]) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(0, 0);
        columns.for_each_block(|block| {
            let of_block = self.covariance_in(block, levels);
            sum = if sum.is_empty() { of_block } else { &sum + of_block };
        });
        sum
    }

    /// What some frequencies add to the covariance of columns.
    pub(super) fn covariance_in(&self, block: &Block, levels: &[f64]) -> DMatrix<f64> {
        let Block { frequencies, of_joints } = block;
        // Parseval: zᵀVz = 1/2π ∫ S(ω) |Z(ω)|² dω, here over real and imaginary parts.
        let length = self.filter.fourier.length() as f64;
        let columns = of_joints.first().map_or(0, DMatrix::ncols);
        let weighted = |((joint, level), values): ((&JointSpectrum, &f64), &DMatrix<f64>)| {
            let root = |k: &usize| {
                let power = joint.power(*k, self.filter.inside);
                (self.filter.multiplicity(*k) * power / length).sqrt() / level
            };
            let roots: Vec<f64> = frequencies.iter().map(root).collect();
            let mut values = values.clone();
            for part in values.as_mut_slice().chunks_exact_mut(frequencies.len()) {
                part.iter_mut().zip(&roots).for_each(|(value, root)| *value *= root);
            }
            values
        };
        let weighted: Vec<_> =
            self.joints.iter().zip(levels).zip(of_joints).map(weighted).collect();
        let mut sum = DMatrix::zeros(columns, columns);
        let mut common = DMatrix::zeros(2 * frequencies.len(), columns);
        for (i, of_joint) in weighted.iter().enumerate() {
            // What all joints have in common with this one.
            vectorised(
                #[inline(always)]
                || {
                    common.fill(0.0);
                    for (j, other) in weighted.iter().enumerate() {
                        let share = self.correlation[(i, j)];
                        for (to, from) in common.as_mut_slice().iter_mut().zip(other.as_slice()) {
                            *to += share * from;
                        }
                    }
                },
            );
            // Each is not symmetric, and their sum is.
            sum += symmetric_product(of_joint, &common);
        }
        sum
    }

    /// Multiplies the power of each joint whose errors have a smaller standard deviation than this.
    pub(super) fn raise_to(&mut self, deviations: &[f64]) {
        let length = self.filter.fourier.length() as f64;
        for (joint, deviation) in self.joints.iter_mut().zip(deviations) {
            let raised = deviation * deviation * length / joint.total(self.filter);
            if raised > 1.0 {
                joint.factor *= raised;
                joint.flat = joint.flat.map(|power| power * raised);
            }
        }
    }

    /// The same power of each joint, as much at each frequency that tells something.
    pub(super) fn whitened(&self) -> Self {
        let mut white = self.clone();
        for (joint, of_joint) in white.joints.iter_mut().enumerate() {
            of_joint.flat = Some(self.mean_power(joint));
        }
        white
    }

    /// The mean power of a joint's errors over the frequencies that tell something.
    pub(super) fn mean_power(&self, joint: usize) -> f64 {
        let inside = self.filter.inside;
        let power = (0..inside).map(|k| self.joints[joint].power(k, inside));
        power.sum::<f64>() / inside as f64
    }

    /// Independent rows of all joints, by the filter alone: rows times the passband.
    pub(super) fn independent_rows(&self) -> f64 {
        self.filter.independent(self.rows) * self.joints.len() as f64
    }

    /// Of every joint, how many independent rows its rows are worth where a mean is formed:
    /// `N γ_0 / Σ_l γ_l`, the mean of the spectrum over its value at frequency 0, and the rows themselves at most: where
    /// errors alternate a mean is better known than of independent ones, which makes no row more than one.
    pub fn effective_rows_per_joint(&self) -> Vec<f64> {
        let length = self.filter.fourier.length() as f64;
        let effective = |joint: &JointSpectrum| {
            let at_zero = joint.power(0, self.filter.inside);
            self.rows as f64 * (joint.total(self.filter) / length / at_zero).min(1.0)
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
fn coherence(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> f64 {
    let dot = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum::<f64>()
    };
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}
