//! Controller of the real cabinet: it computes once per period and holds its command in between.

use super::law::Signals;
use super::{ControlError, ControlTiming, ControllerConfig, JointController, Setpoint};

/// Sampled controllers of an arm with their state.
///
/// At t_k, from the position q_k measured at that instant (per joint):
///
/// ```text
/// e_k = q_r(t_k) − q_k
/// ė_k = (e_k − e_{k−1}) / T          backward difference of the error; ė_0 = 0
/// v_k = (q_k − q_{k−1}) / T          where the law uses the velocity; v_0 = 0
/// I_k = I_{k−1} + T x_k              x the integrand of the law; I_{−1} = 0
/// τ_k = sat(law(e_k, ė_k, v_k, I_k))
/// ```
///
/// I_k = I_{k−1} if τ_k is saturated and x_k has its sign (conditional integration).
#[derive(Clone, Debug)]
pub struct SampledController {
    period_s: f64,
    delay_s: f64,
    joints: Vec<JointChannel>,
    is_started: bool,
}

#[derive(Clone, Debug)]
struct JointChannel {
    controller: JointController,
    integral: f64,
    last_error: f64,
    last_position: f64,
}

impl SampledController {
    /// Creates the controllers of `config`, at rest.
    ///
    /// # Errors
    /// [`ControlError`] if the data are invalid or the timing is not sampled.
    pub fn new(config: &ControllerConfig) -> Result<Self, ControlError> {
        config.validate()?;
        let ControlTiming::Sampled { sample_period_s, computation_delay_s } = config.timing else {
            return Err(ControlError::WrongTiming { expected: "sampled" });
        };
        let channel = |controller: &JointController| JointChannel {
            controller: controller.clone(),
            integral: 0.0,
            last_error: 0.0,
            last_position: 0.0,
        };
        Ok(Self {
            period_s: sample_period_s,
            delay_s: computation_delay_s,
            joints: config.joints.iter().map(channel).collect(),
            is_started: false,
        })
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// Returns the sample period T \[s\].
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Returns the time from a measurement to the action of its command \[s\].
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Resets the controllers to rest, with the same gains.
    pub fn reset(&mut self) {
        for channel in &mut self.joints {
            channel.integral = 0.0;
        }
        self.is_started = false;
    }

    /// Computes one period, from the measured joint positions \[rad\] to the commanded joint
    /// torques \[N·m\]. Every slice has one entry per joint; entries beyond the shortest are
    /// unchanged.
    pub fn update(&mut self, setpoint: Setpoint<'_>, measured_rad: &[f64], torque_nm: &mut [f64]) {
        let reference = setpoint.position.iter().zip(setpoint.velocity).zip(setpoint.acceleration);
        let joints = self.joints.iter_mut().zip(reference).zip(measured_rad).zip(torque_nm);
        for (((channel, ((q_r, dq_r), ddq_r)), q), torque) in joints {
            let error = q_r - q;
            let (error_rate, velocity) = if self.is_started {
                (
                    (error - channel.last_error) / self.period_s,
                    (q - channel.last_position) / self.period_s,
                )
            } else {
                (0.0, 0.0)
            };
            let signals = Signals {
                error,
                error_rate,
                velocity,
                reference_velocity: *dq_r,
                reference_acceleration: *ddq_r,
            };
            *torque = channel.compute_command(&signals, self.period_s);
            channel.last_error = error;
            channel.last_position = *q;
        }
        self.is_started = true;
    }
}

impl JointChannel {
    fn compute_command(&mut self, signals: &Signals, period_s: f64) -> f64 {
        let integrand = self.controller.integrand(signals);
        let integral = self.integral + period_s * integrand;
        let torque = self.controller.torque(signals, integral);
        if self.controller.winds_up(torque, integrand) {
            return self.controller.saturate(self.controller.torque(signals, self.integral));
        }
        self.integral = integral;
        self.controller.saturate(torque)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the expected values are exact in binary")]
mod tests {
    use super::*;
    use crate::control::{ControlLaw, FeedForward};

    const PERIOD: f64 = 0.5;

    fn controller(law: ControlLaw, limit: Option<f64>) -> SampledController {
        let timing = ControlTiming::Sampled { sample_period_s: PERIOD, computation_delay_s: 0.0 };
        let joint =
            JointController { law, feed_forward: FeedForward::default(), torque_limit_nm: limit };
        SampledController::new(&ControllerConfig { timing, joints: vec![joint] }).unwrap()
    }

    fn update(controller: &mut SampledController, reference: [f64; 3], measured: f64) -> f64 {
        let [q, dq, ddq] = reference.map(|value| [value]);
        let setpoint = Setpoint { position: &q, velocity: &dq, acceleration: &ddq };
        let mut torque = [f64::NAN];
        controller.update(setpoint, &[measured], &mut torque);
        torque[0]
    }

    /// Computed by hand: K_τ = 2, Kp = 3, Kd = 0.25, T = 0.5, errors 1, 1.5, 1.25, 1.25.
    #[test]
    fn derivative_is_the_backward_difference_of_the_error() {
        let law = ControlLaw::Pd { kp_per_rad: 3.0, kd_s_per_rad: 0.25, k_tau_nm: 2.0 };
        let mut controller = controller(law, None);
        let torques = [(1.0, 0.0), (1.25, -0.25), (1.5, 0.25), (1.5, 0.25)]
            .map(|(q_r, q)| update(&mut controller, [q_r, 0.0, 0.0], q));
        // 2 (3·1 + 0), 2 (3·1.5 + 0.25·1), 2 (3·1.25 − 0.25·0.5), 2 (3·1.25)
        assert_eq!(torques, [6.0, 9.5, 7.25, 7.5]);
    }

    /// Computed by hand: the integral of sample k already includes e_k.
    #[test]
    fn integral_is_the_backward_rectangle() {
        let law = ControlLaw::Pid {
            kp_per_rad: 1.0,
            kd_s_per_rad: 0.0,
            ki_per_rad_s: 4.0,
            k_tau_nm: 1.0,
            integral_dead_zone_rad: 0.5,
        };
        let mut controller = controller(law, None);
        let torques =
            [1.0, 2.0, 0.25, -1.0].map(|q_r| update(&mut controller, [q_r, 0.0, 0.0], 0.0));
        // I = 0.5, 1.5, 1.5 (inside the dead zone), 1.0
        assert_eq!(torques, [3.0, 8.0, 6.25, 3.0]);
    }

    #[test]
    fn integral_stands_still_in_saturation_and_leaves_it_at_once() {
        let law = ControlLaw::Pid {
            kp_per_rad: 1.0,
            kd_s_per_rad: 0.0,
            ki_per_rad_s: 1.0,
            k_tau_nm: 1.0,
            integral_dead_zone_rad: 0.0,
        };
        let mut limited = controller(law, Some(2.0));
        let mut free = controller(law, None);
        for _ in 0..1000 {
            assert_eq!(update(&mut limited, [10.0, 0.0, 0.0], 0.0), 2.0);
            update(&mut free, [10.0, 0.0, 0.0], 0.0);
        }
        // The error changes its sign. The limited controller responds in the same period. A
        // controller with windup would need a thousand.
        assert_eq!(update(&mut limited, [-1.0, 0.0, 0.0], 0.0), -1.5);
        assert!(update(&mut free, [-1.0, 0.0, 0.0], 0.0) > 4000.0);
    }

    /// A saturated torque must still integrate if the error pulls it back.
    #[test]
    fn integral_unwinds_while_saturated() {
        let law = ControlLaw::Pid {
            kp_per_rad: 0.0,
            kd_s_per_rad: 10.0,
            ki_per_rad_s: 1.0,
            k_tau_nm: 1.0,
            integral_dead_zone_rad: 0.0,
        };
        let mut controller = controller(law, Some(1.0));
        update(&mut controller, [-3.0, 0.0, 0.0], 0.0); // I would be −1.5: saturated, I = 0
        assert_eq!(update(&mut controller, [-1.0, 0.0, 0.0], 0.0), 1.0); // Kd ė = 40, e < 0
        assert_eq!(controller.joints[0].integral, -0.5);
    }

    #[test]
    fn cascaded_loops_take_the_velocity_from_positions() {
        let law = ControlLaw::CascadedPPi {
            kv_per_s: 2.0,
            kp_s_per_rad: 3.0,
            ki_per_rad: 4.0,
            k_tau_nm: 0.5,
        };
        let mut controller = controller(law, None);
        // v_e = 2·1 + 0.5 − 0 = 2.5, I = 1.25: 0.5 (7.5 + 5)
        assert_eq!(update(&mut controller, [1.0, 0.5, 0.0], 0.0), 6.25);
        // v = 0.5/0.5 = 1, v_e = 2·1 + 0.5 − 1 = 1.5, I = 2: 0.5 (4.5 + 8)
        assert_eq!(update(&mut controller, [1.5, 0.5, 0.0], 0.5), 6.25);
    }

    #[test]
    fn feed_forward_is_added_before_the_limit() {
        let timing = ControlTiming::Sampled { sample_period_s: PERIOD, computation_delay_s: 0.0 };
        let joint = JointController {
            law: ControlLaw::P { kp_per_rad: 1.0, k_tau_nm: 1.0 },
            feed_forward: FeedForward { acceleration_kg_m2: 2.0, velocity_nm_s_per_rad: 3.0 },
            torque_limit_nm: Some(10.0),
        };
        let config = ControllerConfig { timing, joints: vec![joint] };
        let mut controller = SampledController::new(&config).unwrap();
        assert_eq!(update(&mut controller, [0.5, 0.25, 1.0], 0.0), 3.25);
        assert_eq!(update(&mut controller, [0.5, 4.0, 1.0], 0.0), 10.0);
    }

    #[test]
    fn bad_data_are_refused_by_name() {
        let law = ControlLaw::Pd { kp_per_rad: 1.0, kd_s_per_rad: f64::NAN, k_tau_nm: 1.0 };
        let timing = ControlTiming::Sampled { sample_period_s: PERIOD, computation_delay_s: 0.0 };
        let joint =
            JointController { law, feed_forward: FeedForward::default(), torque_limit_nm: None };
        let mut config = ControllerConfig { timing, joints: vec![joint] };
        let message = SampledController::new(&config).unwrap_err().to_string();
        assert!(message.contains("joint 1") && message.contains("kd_s_per_rad"), "{message}");
        config.timing = ControlTiming::Sampled { sample_period_s: 0.0, computation_delay_s: 0.0 };
        let message = SampledController::new(&config).unwrap_err().to_string();
        assert!(message.contains("sample_period_s"), "{message}");
    }

    #[test]
    fn a_file_with_an_unknown_key_is_refused() {
        let good = "timing = { kind = 'sampled', sample_period_s = 2e-4 }\n\
                    [[joints]]\n\
                    law = { kind = 'pd', kp_per_rad = 1.0, kd_s_per_rad = 2.0, k_tau_nm = 3.0 }\n";
        let config: ControllerConfig = toml::from_str(good).unwrap();
        assert_eq!(
            config.timing,
            ControlTiming::Sampled { sample_period_s: 2e-4, computation_delay_s: 0.0 }
        );
        for bad in
            [good.replace("kd_s", "kd"), good.replace("k_tau_nm = 3.0", "k_tau_nm = 3.0, ki = 0.0")]
        {
            assert!(toml::from_str::<ControllerConfig>(&bad).is_err(), "{bad}");
        }
    }
}
