//! Disturbance torque on the joints, which no command contains.

use crate::MAX_JOINTS;

use super::white_noise::WhiteNoise;

/// Normal noise on every joint, white or of first order: an Ornstein–Uhlenbeck process, sampled.
#[derive(Clone, Debug)]
pub(super) struct DisturbanceTorque {
    white: WhiteNoise,
    /// a, the correlation of neighbouring samples; 0 of white noise.
    neighbour_correlation: f64,
    /// d_{k−1} \[N·m\]; none before the first sample.
    previous: Option<[f64; MAX_JOINTS]>,
}

impl DisturbanceTorque {
    /// Creates noise with the standard deviation of `white`, whose autocorrelation falls to 1/e in
    /// `correlation_s`; white without one.
    pub(super) fn new(white: WhiteNoise, correlation_s: Option<f64>, period_s: f64) -> Self {
        let neighbours = correlation_s.map_or(0.0, |correlation| (-period_s / correlation).exp());
        Self { white, neighbour_correlation: neighbours, previous: None }
    }

    /// Returns d_k of the next sample \[N·m\]; one entry per joint, 0 beyond them.
    pub(super) fn next(&mut self, joints: usize) -> [f64; MAX_JOINTS] {
        let mut torque = [0.0; MAX_JOINTS];
        if self.white.is_none() {
            return torque;
        }
        self.white.add_to(&mut torque[..joints]);
        // The first sample is drawn from the stationary distribution: d_0 = w_0.
        if let Some(previous) = self.previous {
            // d_k = a d_{k−1} + √(1 − a²) w_k has the variance of w.
            let a = self.neighbour_correlation;
            let fresh = (1.0 - a * a).sqrt();
            for (torque, previous) in torque.iter_mut().zip(previous) {
                *torque = a * previous + fresh * *torque;
            }
        }
        self.previous = Some(torque);
        torque
    }

    /// Returns to the noise of the first sample.
    pub(super) fn restart(&mut self) {
        self.white.restart();
        self.previous = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1e-3;

    fn noise(correlation_s: Option<f64>) -> DisturbanceTorque {
        let white = WhiteNoise::new(7, 1, Some(vec![0.5, 2.0]));
        DisturbanceTorque::new(white, correlation_s, PERIOD_S)
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "the white stream keeps its bits")]
    fn without_a_correlation_it_is_the_white_noise_itself() {
        let mut white = WhiteNoise::new(7, 1, Some(vec![0.5, 2.0]));
        let mut disturbance = noise(None);
        for _ in 0..100 {
            let mut expected = [0.0; MAX_JOINTS];
            white.add_to(&mut expected[..2]);
            assert_eq!(disturbance.next(2), expected);
        }
    }

    /// 200 000 samples know the variance to √(2 (1 + a²)/(1 − a²)/200 000) = 0.7 %, a lag's
    /// correlation to 0.7 %; four times that is allowed.
    #[test]
    fn it_has_its_standard_deviation_and_autocorrelation() {
        let (correlation_s, count) = (0.005, 200_000);
        let mut disturbance = noise(Some(correlation_s));
        let samples: Vec<_> = (0..count).map(|_| disturbance.next(2)).collect();
        for (joint, sd) in [0.5, 2.0].into_iter().enumerate() {
            let product = |lag: usize| {
                let pairs = samples.iter().zip(&samples[lag..]);
                pairs.map(|(a, b)| a[joint] * b[joint]).sum::<f64>() / (count - lag) as f64
            };
            let variance = product(0);
            assert!((variance / (sd * sd) - 1.0).abs() < 0.04, "{variance}");
            for lag in [1_u32, 5, 15] {
                let expected = (-f64::from(lag) * PERIOD_S / correlation_s).exp();
                let autocorrelation = product(lag as usize) / variance;
                assert!(
                    (autocorrelation - expected).abs() < 0.03,
                    "lag {lag}: {autocorrelation}, not {expected}"
                );
            }
        }
    }

    /// A start at 0 would show a variance of 1 − a² = 0.02 at the first sample. 4000 seeds know it
    /// to 2 %.
    #[test]
    fn it_starts_in_its_stationary_distribution() {
        let seeds = 4000;
        let first = |seed| {
            let white = WhiteNoise::new(seed, 1, Some(vec![1.0]));
            DisturbanceTorque::new(white, Some(0.1), PERIOD_S).next(1)[0]
        };
        let variance = (0..seeds).map(|seed| first(seed).powi(2)).sum::<f64>() / seeds as f64;
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
    }

    #[test]
    fn it_restarts_with_the_same_noise() {
        let mut disturbance = noise(Some(0.01));
        let mut run = || -> Vec<_> { (0..10).map(|_| disturbance.next(2)).collect() };
        let first = run();
        disturbance.restart();
        let mut run = || -> Vec<_> { (0..10).map(|_| disturbance.next(2)).collect() };
        assert_eq!(run(), first);
    }
}
