//! Change of the commands due to a change of the positions. The laws are linear.

use super::ControllerConfig;
use super::law::Gains;

/// Derivatives of the commands of an arm's controllers in b directions, from those of the
/// positions. Gains, reference and feed-forward do not change, and there are no torque limits.
///
/// A position change δq is an error change −δq. Rates are the backward differences of the sampled
/// controller (see [`SampledController`](super::SampledController)).
#[derive(Clone, Debug)]
pub(crate) struct CommandVariation {
    period_s: f64,
    joints: Vec<Gains>,
    width: usize,
    /// δI, and δq of the previous sample, n × b each.
    integral_variation: Vec<f64>,
    last_position: Vec<f64>,
    is_started: bool,
}

impl CommandVariation {
    /// Creates the variation of the commands in `width` directions.
    pub(crate) fn new(config: &ControllerConfig, width: usize) -> Self {
        let size = config.joints.len() * width;
        Self {
            period_s: config.timing.sample_period_s(),
            joints: config.joints.iter().map(Gains::from_controller).collect(),
            width,
            integral_variation: vec![0.0; size],
            last_position: vec![0.0; size],
            is_started: false,
        }
    }

    pub(crate) fn reset(&mut self) {
        self.integral_variation.fill(0.0);
        self.is_started = false;
    }

    /// Computes one period of a sampled controller: from the errors \[rad\] and δq to δτ (n × b).
    pub(crate) fn update(&mut self, error: &[f64], position: &[f64], torque: &mut [f64]) {
        let (width, period_s, started) = (self.width, self.period_s, self.is_started);
        let state =
            self.integral_variation.chunks_mut(width).zip(self.last_position.chunks_mut(width));
        let signals = position.chunks(width).zip(torque.chunks_mut(width)).zip(error);
        for ((gains, (integral, last)), ((position, torque), error)) in
            self.joints.iter().zip(state).zip(signals)
        {
            let integrates = gains.integrates(*error);
            let state = integral.iter_mut().zip(last);
            for ((torque, q), (integral, last)) in torque.iter_mut().zip(position).zip(state) {
                let velocity = if started { (q - *last) / period_s } else { 0.0 };
                *last = *q;
                if integrates {
                    *integral += period_s
                        * (gains.integrand_velocity * velocity - gains.integrand_error * q);
                }
                *torque = gains.integral * *integral - gains.error * q
                    + (gains.velocity - gains.error_rate) * velocity;
            }
        }
        self.is_started = true;
    }

    /// Evaluates a continuous controller at one instant: from the errors \[rad\], δq, δq̇ and δI to
    /// δτ and the rate of δI (n × b each).
    pub(crate) fn evaluate(
        &self,
        error: &[f64],
        [position, velocity, integral]: [&[f64]; 3],
        torque: &mut [f64],
        integral_rate: &mut [f64],
    ) {
        for (k, (torque, rate)) in torque.iter_mut().zip(integral_rate).enumerate() {
            let (gains, error) = (&self.joints[k / self.width], error[k / self.width]);
            let (q, dq) = (position[k], velocity[k]);
            let integrand = gains.integrand_velocity * dq - gains.integrand_error * q;
            *rate = if gains.integrates(error) { integrand } else { 0.0 };
            *torque = gains.integral * integral[k] - gains.error * q
                + (gains.velocity - gains.error_rate) * dq;
        }
    }
}
