//! Coordinates of series that begin and end at rest without acceleration.

use core::f64::consts::TAU;

use nalgebra::DMatrix;

use super::limits::DesignLimits;
use super::series::{FourierSeries, JointSeries};

const FEWEST_HARMONICS: usize = 4;
const MOST_HARMONICS: usize = 60;
/// Number of samples per period of the highest frequency. A peak between two samples is at most 3.4
/// % higher than the samples.
const SAMPLES_PER_PERIOD: usize = 12;

/// Position and its first three derivatives along the samples, n × N each, a column per sample.
pub(super) type Motion = [DMatrix<f64>; 4];

/// Units of a joint's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoordinateUnits {
    /// Position at coordinate 0 \[rad or m\].
    pub(super) position: f64,
    /// Unit of that position \[rad or m\].
    pub(super) position_unit: f64,
    /// Unit of the other coordinates \[rad/s or m/s\].
    pub(super) speed_unit: f64,
}

/// Basis of time functions; motions are linear combinations of these functions.
///
/// With a_k = α_k/(kω) and b_k = β_k/(kω), zero velocity at both ends requires Σ α_k = 0, and zero
/// acceleration requires Σ k β_k = 0. So α and β are represented in orthonormal bases of the
/// vectors orthogonal to (1, 1, …) and to (1, 2, …).
pub(super) struct Basis {
    duration_s: f64,
    /// Bases of the sine and cosine amplitudes, H × (H − 1) each.
    sine: DMatrix<f64>,
    cosine: DMatrix<f64>,
    /// Functions and their derivatives at the samples, m × N each.
    derivatives_at_samples: [DMatrix<f64>; 4],
    units: Vec<CoordinateUnits>,
    /// True if the first coordinate of a joint is its first position; false if it is its mean.
    has_first_posture: bool,
}

impl Basis {
    /// Creates the basis of a motion of this length, with the units of each joint. The first
    /// coordinate of a joint is its first position with `has_first_posture`, or else its mean.
    pub(super) fn new(
        duration_s: f64,
        units: Vec<CoordinateUnits>,
        has_first_posture: bool,
    ) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let harmonics = (DesignLimits::DEFAULT.highest_hz * duration_s)
            .clamp(FEWEST_HARMONICS as f64, MOST_HARMONICS as f64) as usize;
        let sine = orthogonal_to(harmonics, |_| 1.0);
        let cosine = orthogonal_to(harmonics, |k| k);
        let samples = SAMPLES_PER_PERIOD * harmonics;
        let omega = TAU / duration_s;
        let derivatives_at_samples = core::array::from_fn(|order| {
            let function = |shift: f64, coordinates: &DMatrix<f64>| {
                let of_harmonic = DMatrix::from_fn(harmonics, samples, |k, i| {
                    let number = 1.0 + k as f64;
                    let phase = number * TAU * i as f64 / samples as f64;
                    let shifted_phase = phase + 0.25 * TAU * (shift + order as f64);
                    (number * omega).powf(order as f64 - 1.0) * shifted_phase.sin()
                });
                coordinates.transpose() * of_harmonic
            };
            let mean = DMatrix::from_element(1, samples, if order == 0 { 1.0 } else { 0.0 });
            let (sines, cosines) = (function(0.0, &sine), function(1.0, &cosine));
            let mut coefficients = mean.resize_vertically(1 + 2 * (harmonics - 1), 0.0);
            coefficients.rows_mut(1, harmonics - 1).copy_from(&sines);
            coefficients.rows_mut(harmonics, harmonics - 1).copy_from(&cosines);
            if has_first_posture && order == 0 {
                // Only the cosines are not 0 at the first sample.
                for mut function in coefficients.row_iter_mut().skip(harmonics) {
                    let first = function[0];
                    function.add_scalar_mut(-first);
                }
            }
            coefficients
        });
        Self { duration_s, sine, cosine, derivatives_at_samples, units, has_first_posture }
    }

    /// Returns the number m of coordinates of each joint: its mean or first position,
    /// its sines, its cosines.
    fn width(&self) -> usize {
        self.derivatives_at_samples[0].nrows()
    }

    /// Returns the number n of joints. The first coordinates are their positions.
    pub(super) fn joints(&self) -> usize {
        self.units.len()
    }

    /// Returns the number of coordinates of all joints, n m.
    pub(super) fn coordinate_count(&self) -> usize {
        self.units.len() * self.width()
    }

    /// Returns the number N of samples.
    pub(super) fn samples(&self) -> usize {
        self.derivatives_at_samples[0].ncols()
    }

    /// Converts coordinates to SI units, without adding the middle of the range (n × m each).
    fn in_units(&self, mut coordinates: DMatrix<f64>) -> DMatrix<f64> {
        for (mut row, unit) in coordinates.row_iter_mut().zip(&self.units) {
            row.iter_mut().skip(1).for_each(|x| *x *= unit.speed_unit);
            row[0] *= unit.position_unit;
        }
        coordinates
    }

    fn matrix(&self, x: &[f64]) -> DMatrix<f64> {
        let coordinates = DMatrix::from_column_slice(self.units.len(), self.width(), x);
        let mut matrix = self.in_units(coordinates);
        for (position, unit) in matrix.column_mut(0).iter_mut().zip(&self.units) {
            *position += unit.position;
        }
        matrix
    }

    /// Returns the motion with these coordinates (n × m, column-major).
    pub(super) fn motion(&self, x: &[f64]) -> Motion {
        let x = self.matrix(x);
        core::array::from_fn(|order| &x * &self.derivatives_at_samples[order])
    }

    /// Converts the gradient with respect to the motion to the gradient with respect to the
    /// coordinates.
    pub(super) fn gradient(&self, by_motion: &Motion, out: &mut [f64]) {
        let mut sum = DMatrix::zeros(self.units.len(), self.width());
        for (by, functions) in by_motion.iter().zip(&self.derivatives_at_samples) {
            sum += by * functions.transpose();
        }
        out.copy_from_slice(self.in_units(sum).as_slice());
    }

    /// Returns the series with these coordinates.
    pub(super) fn series(&self, x: &[f64]) -> FourierSeries {
        let (x, inner) = (self.matrix(x), self.sine.ncols());
        let omega = TAU / self.duration_s;
        let joints = x.row_iter().map(|row| {
            let coefficients = |basis: &DMatrix<f64>, from: usize| -> Vec<f64> {
                let speeds = basis * row.columns(from, inner).transpose();
                speeds.iter().enumerate().map(|(k, v)| v / ((1.0 + k as f64) * omega)).collect()
            };
            let cosine = coefficients(&self.cosine, 1 + inner);
            let first: f64 = if self.has_first_posture { cosine.iter().sum() } else { 0.0 };
            JointSeries { mean: row[0] - first, sine: coefficients(&self.sine, 1), cosine }
        });
        FourierSeries { duration_s: self.duration_s, joints: joints.collect() }
    }
}

/// Returns column `i`, which is one sample.
pub(super) fn column(matrix: &DMatrix<f64>, i: usize) -> &[f64] {
    let n = matrix.nrows();
    &matrix.as_slice()[i * n..(i + 1) * n]
}

/// Returns an orthonormal basis (H × (H − 1)) of the vectors orthogonal to (w(1), w(2), …), by one
/// Householder reflection.
fn orthogonal_to(harmonics: usize, weight: impl Fn(f64) -> f64) -> DMatrix<f64> {
    let mut v: Vec<f64> = (1..=harmonics).map(|k| weight(k as f64)).collect();
    let norm = v.iter().map(|w| w * w).sum::<f64>().sqrt();
    v[0] += norm;
    let square: f64 = v.iter().map(|w| w * w).sum();
    DMatrix::from_fn(harmonics, harmonics - 1, |i, j| {
        let unit = if i == j + 1 { 1.0 } else { 0.0 };
        unit - 2.0 * v[i] * v[j + 1] / square
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_is_its_motion_and_rests_at_both_ends() {
        for has_first_posture in [false, true] {
            check_series(has_first_posture);
        }
    }

    fn check_series(has_first_posture: bool) {
        let unit = |middle, half, speed| CoordinateUnits {
            position: middle,
            position_unit: half,
            speed_unit: speed,
        };
        let basis =
            Basis::new(6.0, vec![unit(0.0, 1.0, 2.0), unit(-2.0, 0.5, 3.0)], has_first_posture);
        let x: Vec<f64> = (0..2 * basis.width()).map(|k| (k as f64 * 1.7).sin()).collect();
        let (motion, series) = (basis.motion(&x), basis.series(&x));
        for i in (1..basis.samples()).step_by(7) {
            let state = series.state(6.0 * i as f64 / basis.samples() as f64);
            let values = [state.position, state.velocity, state.acceleration, state.jerk];
            for (order, (found, motion)) in values.iter().zip(&motion).enumerate() {
                for joint in 0..2 {
                    let scale = 10_f64.powf(order as f64);
                    assert!((found[joint] - motion[(joint, i)]).abs() < 1e-11 * scale, "{order}");
                }
            }
        }
        if has_first_posture {
            let first = [x[0], x[1] * 0.5 - 2.0];
            let close = |joint: usize| (series.state(0.0).position[joint] - first[joint]).abs();
            assert!(close(0) < 1e-12 && close(1) < 1e-12, "{first:?}");
        }
        for near in [1e-7, 6.0 - 1e-7] {
            let state = series.state(near);
            assert!(state.velocity.iter().all(|v| v.abs() < 1e-9), "{state:?}");
            assert!(state.acceleration.iter().all(|a| a.abs() < 1e-3), "{state:?}");
        }
    }
}
