//! Controller that acts at every instant, for comparison with simulation tools.

use super::law::Signals;
use super::{ControlError, ControlTiming, ControllerConfig, JointController, Setpoint};

/// Continuous controllers of an arm. They have no state: the integrals are states of the
/// differential equation and belong to its integrator.
#[derive(Clone, Debug)]
pub struct ContinuousController {
    joints: Vec<JointController>,
}

impl ContinuousController {
    /// Creates the controllers of `config`.
    ///
    /// # Errors
    /// [`ControlError`] if the data are invalid or the timing is not continuous.
    pub fn new(config: &ControllerConfig) -> Result<Self, ControlError> {
        config.validate()?;
        if !matches!(config.timing, ControlTiming::Continuous { .. }) {
            return Err(ControlError::WrongTiming { expected: "continuous" });
        }
        Ok(Self { joints: config.joints.clone() })
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// Evaluates the law at one instant. It returns joint torques \[N·m\] and the rate of the
    /// integrals, from positions \[rad\], velocities \[rad/s\] and the integrals. The rate is zero
    /// if the torque is saturated and the integrand has its sign (conditional integration).
    pub fn evaluate(
        &self,
        setpoint: Setpoint<'_>,
        position_rad: &[f64],
        velocity_rad_s: &[f64],
        integral: &[f64],
        torque_nm: &mut [f64],
        integral_rate: &mut [f64],
    ) {
        let reference = setpoint.position.iter().zip(setpoint.velocity).zip(setpoint.acceleration);
        let state = position_rad.iter().zip(velocity_rad_s).zip(integral);
        let out = torque_nm.iter_mut().zip(integral_rate);
        for (((controller, ((q_r, dq_r), ddq_r)), ((q, dq), integral)), (torque, rate)) in
            self.joints.iter().zip(reference).zip(state).zip(out)
        {
            let signals = Signals {
                error: q_r - q,
                error_rate: dq_r - dq,
                velocity: *dq,
                reference_velocity: *dq_r,
                reference_acceleration: *ddq_r,
            };
            let unlimited = controller.torque(&signals, *integral);
            let integrand = controller.integrand(&signals);
            *rate = if controller.winds_up(unlimited, integrand) { 0.0 } else { integrand };
            *torque = controller.saturate(unlimited);
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the expected values are exact in binary")]
mod tests {
    use super::*;
    use crate::control::{ControlLaw, FeedForward};

    #[test]
    fn integral_rate_stops_in_saturation() {
        let law = ControlLaw::Pid {
            kp_per_rad: 2.0,
            kd_s_per_rad: 0.5,
            ki_per_rad_s: 1.0,
            k_tau_nm: 1.0,
            integral_dead_zone_rad: 0.0,
        };
        let joint = JointController {
            law,
            feed_forward: FeedForward::default(),
            torque_limit_nm: Some(3.0),
        };
        let config = ControllerConfig {
            timing: ControlTiming::Continuous { sample_period_s: 1.0 },
            joints: vec![joint],
        };
        let controller = ContinuousController::new(&config).unwrap();
        let evaluate = |q_r: f64, dq: f64, integral: f64| {
            let (mut torque, mut rate) = ([0.0], [0.0]);
            let setpoint = Setpoint { position: &[q_r], velocity: &[0.0], acceleration: &[0.0] };
            controller.evaluate(setpoint, &[0.0], &[dq], &[integral], &mut torque, &mut rate);
            (torque[0], rate[0])
        };
        assert_eq!(evaluate(1.0, 1.0, 0.5), (2.0, 1.0));
        assert_eq!(evaluate(1.0, 0.0, 2.0), (3.0, 0.0));
        assert_eq!(evaluate(-1.0, 0.0, 9.0), (3.0, -1.0));
    }
}
