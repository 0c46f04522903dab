//! Valid standard deviations for residuals that are not white.
//!
//! Equation 10 assumes independent errors of the rows, but they are not independent. The parallel
//! filter removes frequencies below the Nyquist frequency of the rows, and torque noise and model
//! errors are coloured. This module models the errors of each joint as a stationary process. Its
//! power spectrum is that of filtered white noise, multiplied by a smooth function that is fitted
//! to the residuals.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::limits::RegressionLimits;
use super::ljung_box::LjungBox;
use super::observations::Observations;
use super::products::symmetric_product;
use super::row_filter::RowFilter;
use super::spectra::{FrequencyBlock, Spectra};
use super::spectrum_shape::SmoothSpectrum;
use didim_dynamics::numeric::with_vector_instructions;

/// Errors ε of `y = X θ + ε` as stationary processes: a power spectrum per joint, and the
/// correlation between the joints.
#[derive(Clone, Debug)]
pub struct ResidualSpectrum<'a> {
    rows: usize,
    /// Number of equivalent rows of which one counts.
    repeats: f64,
    filter: &'a RowFilter,
    joints: Vec<JointSpectrum>,
    /// Correlation between the joints' errors at the same instant (n × n).
    correlation: DMatrix<f64>,
    /// Number of joints with an equation.
    joints_with_equation: usize,
}

#[derive(Clone, Debug)]
struct JointSpectrum {
    /// Power at each frequency of the transform, from 0 to the Nyquist frequency, up to `factor`.
    /// Spectra that differ only by a factor share these values.
    shape: Arc<[f64]>,
    factor: f64,
    /// Power at the informative frequencies, if it is the same at all of them.
    flat_power: Option<f64>,
    /// Autocorrelations from lag 1, without the colour that is due to the filter.
    autocorrelations: Vec<f64>,
}

impl JointSpectrum {
    /// Returns the power at a frequency. The first `inside` frequencies are the informative ones.
    fn power(&self, frequency: usize, inside: usize) -> f64 {
        match self.flat_power {
            Some(power) if frequency < inside => power,
            _ => self.factor * self.shape[frequency],
        }
    }

    /// Returns the power of all frequencies, including mirror images.
    fn total(&self, filter: &RowFilter) -> f64 {
        let power = (0..self.shape.len()).map(|k| (k, self.power(k, filter.passband_frequencies)));
        power.map(|(k, power)| filter.multiplicity(k) * power).sum()
    }
}

impl<'a> ResidualSpectrum<'a> {
    /// Fits the spectrum to unweighted residuals (r). `leverage` is the share of the power that the
    /// fit has removed at each frequency, for each joint. One of `repeats` equivalent rows counts.
    pub(super) fn fit(
        system: &Observations,
        leverage: &[Vec<f64>],
        residuals: &DVector<f64>,
        filter: &'a RowFilter,
        repeats: f64,
    ) -> Self {
        let independent_rows = filter.independent_rows(system.rows_per_joint()) / repeats;
        let rows = system.rows_per_joint();
        let (mut joints, mut whitened) = (Vec::new(), Vec::new());
        let transforms = filter.transforms(residuals.as_slice(), rows);
        let width = repeats * filter.fourier.length() as f64 / rows as f64;
        for ((joint, leverage), mut parts) in leverage.iter().enumerate().zip(transforms) {
            let leverage = leverage_counting_once(leverage, repeats, width);
            let [re, im] = &parts;
            let squares = re.iter().zip(im).map(|(re, im)| re * re + im * im);
            let periodogram: Vec<f64> = squares
                .zip(&*leverage)
                .zip(&filter.power)
                .map(|((square, leverage), filtered)| {
                    let degrees = 1.0 - leverage.min(RegressionLimits::DEFAULT.max_explained_share);
                    square / (rows as f64 * degrees * filtered)
                })
                .collect();
            let mut shape = SmoothSpectrum::fit(&filter.band, &periodogram, independent_rows);
            // The residuals of an exact fit are rounding errors, whose power is not zero.
            let measured = system.measurements().rows_range(system.joint_rows(joint));
            let rounding = measured.norm_squared() / rows as f64 * f64::EPSILON.powi(2);
            let least = SmoothSpectrum::flat(rounding.max(f64::MIN_POSITIVE));
            if shape.at_zero() < least.at_zero() {
                shape = least;
            }
            // A joint without an equation has no residuals, and its power does not matter.
            if !system.matrix().has_equation(joint) {
                shape = SmoothSpectrum::flat(1.0);
            }
            let shape_values = shape.values(&filter.band);
            let power: Arc<[f64]> =
                filter.power.iter().zip(shape_values).map(|(filtered, g)| filtered * g).collect();
            for part in &mut parts {
                part.iter_mut().zip(&*power).for_each(|(value, power)| *value /= power.sqrt());
            }
            whitened.push(parts);
            let autocorrelations = shape.autocorrelations;
            joints.push(JointSpectrum {
                shape: power,
                factor: 1.0,
                flat_power: None,
                autocorrelations,
            });
        }
        let correlation = DMatrix::from_fn(joints.len(), joints.len(), |i, j| {
            if i == j { 1.0 } else { coherence(&whitened[i], &whitened[j]) }
        });
        let joints_with_equation = system.matrix().joints_with_equation();
        Self { rows, repeats, filter, joints, correlation, joints_with_equation }
    }

    /// Returns the covariance `ZᵀVZ` of `Zᵀε` (c × c), with Z = Ω^{-1/2} C of the transformed
    /// columns and these noise levels.
    pub(super) fn covariance_of(&self, columns: &Spectra<'_>, levels: &[f64]) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(0, 0);
        columns.for_each_block(|block| {
            let of_block = self.covariance_in(block, levels);
            sum = if sum.is_empty() { of_block } else { &sum + of_block };
        });
        sum
    }

    /// Returns the contribution of some frequencies to the covariance of columns.
    pub(super) fn covariance_in(&self, block: &FrequencyBlock, levels: &[f64]) -> DMatrix<f64> {
        let FrequencyBlock { frequencies, of_joints } = block;
        // Parseval: zᵀVz = 1/2π ∫ S(ω) |Z(ω)|² dω, here over real and imaginary parts.
        let length = self.filter.fourier.length() as f64;
        let columns = of_joints.first().map_or(0, DMatrix::ncols);
        let weighted = |((joint, level), values): ((&JointSpectrum, &f64), &DMatrix<f64>)| {
            let root = |k: &usize| {
                let power = joint.power(*k, self.filter.passband_frequencies);
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
            // Part of the other joints' errors that is correlated with this joint.
            with_vector_instructions(
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
            // The single terms are not symmetric, but their sum is.
            sum += symmetric_product(of_joint, &common);
        }
        sum
    }

    /// Raises the power of each joint whose errors have a smaller standard deviation than the given
    /// one. Returns true if there is one.
    pub(super) fn raise_to(&mut self, deviations: &[f64]) -> bool {
        let mut is_raised = false;
        let length = self.filter.fourier.length() as f64;
        for (joint, deviation) in self.joints.iter_mut().zip(deviations) {
            let raised = deviation * deviation * length / joint.total(self.filter);
            if raised > 1.0 {
                is_raised = true;
                joint.factor *= raised;
                joint.flat_power = joint.flat_power.map(|power| power * raised);
            }
        }
        is_raised
    }

    /// Returns a spectrum with the same power of each joint, equal at all informative frequencies.
    pub(super) fn to_white(&self) -> Self {
        let mut white = self.clone();
        for (joint, of_joint) in white.joints.iter_mut().enumerate() {
            of_joint.flat_power = Some(self.mean_power(joint));
        }
        white
    }

    /// Returns the mean power of a joint's errors over the informative frequencies.
    pub(super) fn mean_power(&self, joint: usize) -> f64 {
        let inside = self.filter.passband_frequencies;
        let power = (0..inside).map(|k| self.joints[joint].power(k, inside));
        power.sum::<f64>() / inside as f64
    }

    /// Returns the number of independent rows of all joints. Only the filter is taken into account:
    /// rows times the passband.
    pub(super) fn independent_rows(&self) -> f64 {
        self.independent_rows_per_joint() * self.joints_with_equation as f64
    }

    fn independent_rows_per_joint(&self) -> f64 {
        self.filter.independent_rows(self.rows) / self.repeats
    }

    /// Returns the number of independent rows that determine a mean as well as each joint's rows:
    /// `N γ_0 / Σ_l γ_l`. This is the mean of the spectrum divided by its value at frequency 0,
    /// limited to the number of rows. Errors with negative correlation determine a mean better than
    /// independent ones, but no row counts as more than one.
    pub fn effective_rows_per_joint(&self) -> Vec<f64> {
        let length = self.filter.fourier.length() as f64;
        self.joints
            .iter()
            .map(|joint: &JointSpectrum| {
                let at_zero = joint.power(0, self.filter.passband_frequencies);
                self.rows as f64 / self.repeats
                    * (joint.total(self.filter) / length / at_zero).min(1.0)
            })
            .collect()
    }

    /// Tests every joint for whiteness. The test uses the autocorrelations without the colour of
    /// the filter. The number of independent samples is the number of rows times the passband.
    pub fn ljung_box_per_joint(&self) -> Vec<LjungBox> {
        let samples = self.independent_rows_per_joint();
        self.joints
            .iter()
            .map(|joint| LjungBox::from_autocorrelations(&joint.autocorrelations, samples))
            .collect()
    }
}

/// Returns the share of the power that a fit removes from distinct rows, at each frequency.
///
/// The columns of a motion that is repeated have power at lines only, at every `width`-th
/// frequency. The fit removes nothing between them, and the same share at the lines as from a
/// single motion, but a transform that is longer than the record shows neither. The mean over a
/// line and its surroundings times the number of repetitions is the share of a single motion.
fn leverage_counting_once(leverage: &[f64], repeats: f64, width: f64) -> Cow<'_, [f64]> {
    if repeats <= 1.0 {
        return Cow::Borrowed(leverage);
    }
    let mut sums = vec![0.0];
    for (k, share) in leverage.iter().enumerate() {
        sums.push(sums[k] + share);
    }
    let end = leverage.len() as f64;
    (0..leverage.len())
        .map(|k| {
            let first = (k as f64 + 0.5 - 0.5 * width).max(0.0);
            let last = (k as f64 + 0.5 + 0.5 * width).min(end);
            let sum = sum_to(&sums, leverage, last) - sum_to(&sums, leverage, first);
            repeats * sum / (last - first)
        })
        .collect()
}

/// Returns the sum up to a place between frequencies, from the sums up to each frequency. Frequency
/// k reaches from k to k + 1.
fn sum_to(sums: &[f64], values: &[f64], place: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the end")]
    let index = place.min((values.len() - 1) as f64) as usize;
    sums[index] + (place - index as f64) * values[index]
}

/// Returns the real part of the coherence of two transforms, from their real and imaginary parts.
fn coherence(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> f64 {
    let dot = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum::<f64>()
    };
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}
