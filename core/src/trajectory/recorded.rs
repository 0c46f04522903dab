//! A reference that was recorded sample by sample.

use nalgebra::DMatrix;

use super::{Reference, TrajectoryError};

/// A recorded reference: exact at its samples, interpolated in between.
///
/// Velocities at the samples are central differences (one-sided at the ends); between samples the
/// position is the cubic Hermite polynomial through positions and velocities of the two
/// neighbours, and velocity and acceleration are its derivatives. A reference that is held over
/// the step while a continuous controller runs at every stage would delay it by half a period.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledReference {
    sample_rate_hz: f64,
    /// One column per sample, so that a sample is one slice.
    position: DMatrix<f64>,
    velocity: DMatrix<f64>,
}

impl SampledReference {
    /// From joint positions \[rad\], one row per sample and one column per joint, the first at
    /// time 0.
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
        let velocity = DMatrix::from_fn(position.nrows(), position.ncols(), |j, k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            let steps = if after - before == 2 { 2.0 } else { 1.0 };
            (position[(j, after)] - position[(j, before)]) * sample_rate_hz / steps
        });
        Ok(Self { sample_rate_hz, position, velocity })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.position.ncols()
    }
}

impl Reference for SampledReference {
    fn joints(&self) -> usize {
        self.position.nrows()
    }

    fn at(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        let last = self.position.ncols() - 1;
        let at_samples = time_s * self.sample_rate_hz;
        // The last sample begins no interval: stand still outside the record.
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
        let (q0, q1) = (self.position.column(k), self.position.column(k + 1));
        let (v0, v1) = (self.velocity.column(k), self.velocity.column(k + 1));
        let ends = q0.iter().zip(q1.iter()).zip(v0.iter().zip(v1.iter()));
        let out = position.iter_mut().zip(velocity).zip(acceleration);
        for (((q, dq), ddq), ((q0, q1), (v0, v1))) in out.zip(ends) {
            // q(s) = q0 + s (m0 + s (c2 + s c3)) with m = v / rate.
            let (m0, m1, d) = (v0 / rate, v1 / rate, q1 - q0);
            let (c2, c3) = (3.0 * d - 2.0 * m0 - m1, m0 + m1 - 2.0 * d);
            *q = q0 + s * (m0 + s * (c2 + s * c3));
            *dq = rate * (m0 + s * (2.0 * c2 + s * 3.0 * c3));
            *ddq = rate * rate * (2.0 * c2 + s * 6.0 * c3);
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "positions at rest are exact")]
mod tests {
    use super::*;

    fn at(reference: &SampledReference, time_s: f64) -> [f64; 3] {
        let [mut q, mut dq, mut ddq] = [[f64::NAN]; 3];
        reference.at(time_s, &mut q, &mut dq, &mut ddq);
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
            for (found, expected) in at(&reference, t).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{t}: {found} {expected}");
            }
        }
    }

    #[test]
    fn stands_still_outside_the_record() {
        let record = DMatrix::from_column_slice(3, 1, &[1.0, 2.0, 4.0]);
        let reference = SampledReference::new(10.0, &record).unwrap();
        assert_eq!(at(&reference, -0.1), [1.0, 0.0, 0.0]);
        assert_eq!(at(&reference, 0.2), [4.0, 0.0, 0.0]);
        assert_eq!(at(&reference, f64::NAN)[0], 4.0);
        assert!((at(&reference, 0.1)[0] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn bad_records_are_refused() {
        assert!(SampledReference::new(10.0, &DMatrix::zeros(1, 2)).is_err());
        assert!(SampledReference::new(f64::NAN, &DMatrix::zeros(3, 2)).is_err());
        assert!(SampledReference::new(10.0, &DMatrix::repeat(3, 2, f64::INFINITY)).is_err());
    }
}
