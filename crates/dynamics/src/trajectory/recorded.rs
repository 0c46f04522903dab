//! A reference that was recorded sample by sample.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Reference, TrajectoryError};

/// Interpolation of a drive between two targets; d is their difference, T their period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceInterpolation {
    /// The cubic Hermite polynomial through positions and velocities of the two neighbours, with
    /// central differences for the velocities (one-sided at the ends); velocity and acceleration
    /// are its derivatives.
    #[default]
    Cubic,
    /// A straight line: velocity d/T of the interval that begins, acceleration 0.
    Linear,
    /// The target itself until the next: velocity d/T of the interval that has ended (a drive knows
    /// no later one), and acceleration 0. Under a continuous controller this delays the reference
    /// by half a period.
    Hold,
}

/// A recorded reference: exact at its samples, interpolated in between.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledReference {
    sample_rate_hz: f64,
    interpolation: ReferenceInterpolation,
    delay_s: f64,
    /// One column per sample, so that a sample is one slice.
    position: DMatrix<f64>,
    /// The same for the velocities, per sample instead of per second.
    slope: DMatrix<f64>,
}

/// A time this close to a sample, in samples, is that of the sample: the product of time and rate
/// is off by rounding.
const SAME_SAMPLE: f64 = 1e-7;

impl SampledReference {
    /// Creates a reference from joint positions \[rad\], one row per sample and one column per
    /// joint, the first at time 0, with [`ReferenceInterpolation::Cubic`].
    ///
    /// # Errors
    /// [`TrajectoryError::BadRecord`] when there are fewer than two samples, a value is not finite
    /// or the sample rate is not positive.
    pub fn new(sample_rate_hz: f64, position_rad: &DMatrix<f64>) -> Result<Self, TrajectoryError> {
        let bad = |reason| Err(TrajectoryError::BadRecord { reason });
        if !(sample_rate_hz.is_finite() && sample_rate_hz > 0.0) {
            return bad("the sample rate must be finite and positive");
        }
        if position_rad.nrows() < 2 || position_rad.ncols() == 0 {
            return bad("there must be at least two samples of one joint");
        }
        if !position_rad.iter().all(|q| q.is_finite()) {
            return bad("every position must be a finite number");
        }
        let position = position_rad.transpose();
        let last = position.ncols() - 1;
        let slope = DMatrix::from_fn(position.nrows(), position.ncols(), |j, k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            let steps = if after - before == 2 { 2.0 } else { 1.0 };
            (position[(j, after)] - position[(j, before)]) / steps
        });
        let interpolation = ReferenceInterpolation::Cubic;
        Ok(Self { sample_rate_hz, interpolation, delay_s: 0.0, position, slope })
    }

    /// Returns the same samples with another interpolation.
    #[must_use]
    pub fn with_interpolation(mut self, interpolation: ReferenceInterpolation) -> Self {
        self.interpolation = interpolation;
        self
    }

    /// Returns the same reference delayed by this time \[s\]; before its start, the first sample is
    /// held.
    #[must_use]
    pub fn with_delay_s(mut self, delay_s: f64) -> Self {
        self.delay_s = delay_s;
        self
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.position.ncols()
    }

    /// Returns the time from 0 to the last sample \[s\].
    pub fn duration_s(&self) -> f64 {
        (self.samples() - 1) as f64 / self.sample_rate_hz + self.delay_s
    }
}

impl Reference for SampledReference {
    fn joints(&self) -> usize {
        self.position.nrows()
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        let last = self.position.ncols() - 1;
        let exactly = (time_s - self.delay_s) * self.sample_rate_hz;
        let nearest = exactly.round();
        let at_samples = if (exactly - nearest).abs() < SAME_SAMPLE { nearest } else { exactly };
        // The last sample begins no interval. Outside the record the reference stands still.
        #[allow(clippy::cast_precision_loss, reason = "a record has far fewer samples than 2^52")]
        let outside = at_samples < 0.0 || at_samples >= last as f64;
        let k = if at_samples < 0.0 { 0 } else { last };
        if outside || !at_samples.is_finite() {
            let stand = self.position.column(k);
            let out = position.iter_mut().zip(velocity).zip(acceleration);
            for (((q, dq), ddq), stand) in out.zip(stand.iter()) {
                (*q, *dq, *ddq) = (*stand, 0.0, 0.0);
            }
            return;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked: finite, not negative, below the number of samples"
        )]
        let k = at_samples as usize;
        let s = at_samples.fract();
        let rate = self.sample_rate_hz;
        let (q0, q1) = (sample_column(&self.position, k), sample_column(&self.position, k + 1));
        let (m0, m1) = (sample_column(&self.slope, k), sample_column(&self.slope, k + 1));
        let before = sample_column(&self.position, k.saturating_sub(1));
        let ends = q0.iter().zip(q1).zip(m0.iter().zip(m1)).zip(before);
        let out = position.iter_mut().zip(velocity).zip(acceleration);
        for (((q, dq), ddq), (((q0, q1), (m0, m1)), before)) in out.zip(ends) {
            let d = q1 - q0;
            (*q, *dq, *ddq) = match self.interpolation {
                ReferenceInterpolation::Cubic => {
                    // q(s) = q0 + s (m0 + s (c2 + s c3))
                    let (c2, c3) = (3.0 * d - 2.0 * m0 - m1, m0 + m1 - 2.0 * d);
                    (
                        q0 + s * (m0 + s * (c2 + s * c3)),
                        rate * (m0 + s * (2.0 * c2 + s * 3.0 * c3)),
                        rate * rate * (2.0 * c2 + s * 6.0 * c3),
                    )
                }
                ReferenceInterpolation::Linear => (q0 + s * d, rate * d, 0.0),
                ReferenceInterpolation::Hold => (*q0, rate * (q0 - before), 0.0),
            };
        }
    }
}

/// Returns column `k`.
fn sample_column(signals: &DMatrix<f64>, k: usize) -> &[f64] {
    let joints = signals.nrows();
    &signals.as_slice()[k * joints..(k + 1) * joints]
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "positions at rest are exact")]
mod tests {
    use super::*;

    fn state_at(reference: &SampledReference, time_s: f64) -> [f64; 3] {
        let [mut q, mut dq, mut ddq] = [[f64::NAN]; 3];
        reference.evaluate(time_s, &mut q, &mut dq, &mut ddq);
        [q[0], dq[0], ddq[0]]
    }

    /// Central differences of a parabola are exact, and a cubic reproduces it.
    #[test]
    fn a_parabola_is_reproduced_between_samples() {
        let record = DMatrix::from_fn(50, 1, |k, _| {
            let t = k as f64 / 10.0;
            1.0 + 2.0 * t - 3.0 * t * t
        });
        let reference = SampledReference::new(10.0, &record).unwrap();
        for k in 0..300 {
            let t = 0.1 + 0.01 * f64::from(k);
            let expected = [1.0 + 2.0 * t - 3.0 * t * t, 2.0 - 6.0 * t, -6.0];
            for (found, expected) in state_at(&reference, t).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{t}: {found} {expected}");
            }
        }
    }

    #[test]
    fn stands_still_outside_the_record() {
        let record = DMatrix::from_column_slice(3, 1, &[1.0, 2.0, 4.0]);
        let reference = SampledReference::new(10.0, &record).unwrap();
        assert_eq!(state_at(&reference, -0.1), [1.0, 0.0, 0.0]);
        assert_eq!(state_at(&reference, 0.2), [4.0, 0.0, 0.0]);
        assert_eq!(state_at(&reference, f64::NAN)[0], 4.0);
        assert!((state_at(&reference, 0.1)[0] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn between_targets_a_drive_does_what_is_stated() {
        let record = DMatrix::from_column_slice(4, 1, &[1.0, 2.0, 4.0, 3.0]);
        let cubic = SampledReference::new(10.0, &record).unwrap();
        let linear = cubic.clone().with_interpolation(ReferenceInterpolation::Linear);
        let hold = cubic.with_interpolation(ReferenceInterpolation::Hold);
        assert_eq!(state_at(&linear, 0.125), [2.5, 20.0, 0.0]);
        assert_eq!(state_at(&linear, 0.1), [2.0, 20.0, 0.0]);
        assert_eq!(state_at(&hold, 0.125), [2.0, 10.0, 0.0]);
        assert_eq!(state_at(&hold, 0.05), [1.0, 0.0, 0.0]);
        assert_eq!(state_at(&hold, 0.2), [4.0, 20.0, 0.0]);
    }

    /// 3·0.1 − 0.1 is below 0.2 by rounding, and must be the sample at 0.2 all the same.
    #[test]
    fn a_delay_of_one_period_is_one_sample() {
        let record = DMatrix::from_fn(1000, 1, |k, _| k as f64);
        let hold = SampledReference::new(10.0, &record)
            .unwrap()
            .with_interpolation(ReferenceInterpolation::Hold)
            .with_delay_s(0.1);
        for k in 1..1000 {
            assert_eq!(state_at(&hold, k as f64 * 0.1)[0], k as f64 - 1.0);
        }
        assert_eq!(state_at(&hold, 0.0), [0.0, 0.0, 0.0]);
    }

    #[test]
    fn bad_records_are_refused() {
        assert!(SampledReference::new(10.0, &DMatrix::zeros(1, 2)).is_err());
        assert!(SampledReference::new(f64::NAN, &DMatrix::zeros(3, 2)).is_err());
        assert!(SampledReference::new(10.0, &DMatrix::repeat(3, 2, f64::INFINITY)).is_err());
    }
}
