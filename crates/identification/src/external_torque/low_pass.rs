//! First-order low-pass of signals that are linear between two samples.

/// Weights of y' = K (u − y) over one sample period T, exact for an input that is linear between
/// its samples (first-order hold): y_k = a y_{k−1} + b u_{k−1} + c u_k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LowPass {
    /// a, the decay of the state.
    decay: f64,
    /// b, the weight of the previous input.
    previous: f64,
    /// c, the weight of this input.
    current: f64,
}

impl LowPass {
    /// Creates the filter of `gain_per_s` (K) at a sample period \[s\].
    pub(super) fn new(gain_per_s: f64, period_s: f64) -> Self {
        let x = gain_per_s * period_s;
        let decay = (-x).exp();
        // (1 − a) / x, without cancellation for short periods.
        let mean = -(-x).exp_m1() / x;
        Self { decay, previous: mean - decay, current: 1.0 - mean }
    }

    /// Advances states by one sample, from the previous inputs to these.
    pub(super) fn advance(&self, states: &mut [f64], previous: &mut [f64], inputs: &[f64]) {
        for ((state, previous), input) in states.iter_mut().zip(previous).zip(inputs) {
            *state = self.decay * *state + self.previous * *previous + self.current * input;
            *previous = *input;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The response to a ramp from rest is t − (1 − e^(−Kt)) / K.
    #[test]
    fn ramps_and_steps_are_exact_at_any_period() {
        let gain = 60.0;
        for period in [1e-5, 2e-3, 0.05] {
            let filter = LowPass::new(gain, period);
            let (mut states, mut inputs) = ([0.0; 2], [0.0, 1.0]);
            for k in 1..200 {
                let t = f64::from(k) * period;
                filter.advance(&mut states, &mut inputs, &[t, 1.0]);
                let response = -(-gain * t).exp_m1();
                assert!((states[0] - (t - response / gain)).abs() < 1e-12 * t.max(1.0));
                assert!((states[1] - response).abs() < 1e-12);
            }
        }
    }
}
