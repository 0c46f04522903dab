//! Noise of measured positions, as the positions themselves show it.

use didim_dynamics::MAX_JOINTS;

/// Sum of the squared weights of a third difference, 1 + 9 + 9 + 1.
const THIRD_DIFFERENCE_POWER: f64 = 20.0;

/// Running estimate of the variance of each axis' position noise: quantisation of the encoder, and
/// noise.
///
/// A third difference removes a smooth motion. Its variance is 20 s² for independent errors with
/// the variance s².
#[derive(Clone, Debug)]
pub(super) struct PositionNoise {
    /// Share of the estimate that remains after a sample.
    decay: f64,
    /// The last three positions, newest first.
    last: [[f64; MAX_JOINTS]; 3],
    count: usize,
    /// Variance of each axis \[rad² or m²\].
    pub(super) variances: [f64; MAX_JOINTS],
}

impl PositionNoise {
    /// Creates an estimate with a memory of this number of samples.
    pub(super) fn new(memory_samples: f64) -> Self {
        let decay = (-1.0 / memory_samples.max(1.0)).exp();
        Self { decay, last: [[0.0; MAX_JOINTS]; 3], count: 0, variances: [0.0; MAX_JOINTS] }
    }

    /// Forgets the positions, and keeps the variances.
    pub(super) fn restart(&mut self) {
        self.count = 0;
    }

    /// Takes the positions of the next sample.
    pub(super) fn push(&mut self, positions: &[f64]) {
        let [newest, middle, oldest] = &self.last;
        if self.count == 3 {
            for (axis, position) in positions.iter().enumerate() {
                let third = position - 3.0 * newest[axis] + 3.0 * middle[axis] - oldest[axis];
                let variance = third * third / THIRD_DIFFERENCE_POWER;
                let estimate = &mut self.variances[axis];
                *estimate = self.decay * *estimate + (1.0 - self.decay) * variance;
            }
        }
        self.last.rotate_right(1);
        self.last[0][..positions.len()].copy_from_slice(positions);
        self.count = (self.count + 1).min(3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_an_encoder_are_uniform_errors_and_smooth_motion_is_none() {
        let (count, mut noise) = (1e-4, PositionNoise::new(1000.0));
        for k in 0..20_000 {
            let t = f64::from(k) * 1e-3;
            let q = (3.0 * t).sin() + 0.7 * t;
            noise.push(&[q, (q / count).round() * count, 0.5]);
        }
        let [smooth, counted, still] = [0, 1, 2].map(|axis| noise.variances[axis].sqrt());
        let expected = count / 12.0_f64.sqrt();
        assert!(smooth < 0.01 * expected && still < 1e-300, "{smooth} {still}");
        assert!((counted / expected - 1.0).abs() < 0.15, "{counted} {expected}");
    }
}
