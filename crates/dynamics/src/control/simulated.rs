//! Controller of a simulation whose arm is only known from an estimate.

use crate::robot::JointIndex;
use core::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    ControlError, ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
};

/// Controller of the arm in the simulations of an identification.
///
/// Torque limits are left out. Far from the true parameters, the simulated arm may need torques
/// that the real one never reaches. A limit would then open the loop. From a start with unit drive
/// inertias the limits of a TX40 make its joint 6 diverge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SimulatedController {
    /// Gains of the cabinet.
    Cabinet {
        /// When the controllers compute: one of the forms below.
        timing: ControlTiming,
        /// The controller of each joint, in the order of the joints.
        joints: Vec<JointController>,
        /// The inertia that each joint's gains were tuned for \[kg·m²\]. Torque gain and
        /// feed-forward are multiplied by the estimated inertia over this one, so the bandwidth
        /// stays the same from one estimate to the next.
        ///
        /// If left out: the gains stay as they are.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rescale_to_inertia_kg_m2: Option<Vec<f64>>,
    },
    /// The gains are unknown. Proportional and derivative control of a configured bandwidth is
    /// computed from the estimated inertia J of each joint:
    ///
    /// ```text
    /// τ = J ω² e + 2 ζ J ω ė (+ J q̈_r)        ω = 2π · bandwidth
    /// ```
    Bandwidth {
        /// When the controllers compute: one of the forms below.
        timing: ControlTiming,
        /// ω/2π of each joint \[Hz\].
        bandwidth_hz: Vec<f64>,
        /// ζ, the damping ratio; 0.8 is a usual one.
        damping: f64,
        /// True adds J q̈r. Without it a loop of low bandwidth lags behind its reference.
        acceleration_feed_forward: bool,
    },
}

impl SimulatedController {
    /// Returns the time at which the controllers compute.
    pub fn timing(&self) -> ControlTiming {
        match self {
            Self::Cabinet { timing, .. } | Self::Bandwidth { timing, .. } => *timing,
        }
    }

    /// Returns the controllers of a loop whose bandwidth is `factor` times as large
    /// ([`ControllerConfig::with_bandwidth`]).
    ///
    /// # Errors
    /// [`ControlError`] if the factor is not finite and positive.
    pub fn with_bandwidth(self, factor: f64) -> Result<Self, ControlError> {
        Ok(match self {
            Self::Bandwidth { .. } if !(factor.is_finite() && factor > 0.0) => {
                return Err(ControlError::Bandwidth { factor });
            }
            Self::Cabinet { timing, joints, rescale_to_inertia_kg_m2 } => {
                let config = ControllerConfig { timing, joints }.with_bandwidth(factor)?;
                Self::Cabinet { timing, joints: config.joints, rescale_to_inertia_kg_m2 }
            }
            Self::Bandwidth { timing, mut bandwidth_hz, damping, acceleration_feed_forward } => {
                bandwidth_hz.iter_mut().for_each(|hz| *hz *= factor);
                Self::Bandwidth { timing, bandwidth_hz, damping, acceleration_feed_forward }
            }
        })
    }

    /// Returns the controllers with feedback `factor` times as large, as if all torque gains were.
    #[must_use]
    pub fn with_gain(mut self, factor: f64) -> Self {
        match &mut self {
            Self::Cabinet { joints, .. } => {
                for joint in joints {
                    *joint = joint.scaled(factor);
                }
            }
            // J ω² and 2 ζ J ω are multiplied by this factor; J q̈_r is no feedback.
            Self::Bandwidth { bandwidth_hz, damping, .. } => {
                bandwidth_hz.iter_mut().for_each(|hz| *hz *= factor.sqrt());
                *damping *= factor.sqrt();
            }
        }
        self
    }

    /// Returns the controllers for joints of these inertias \[kg·m²\], one per joint, all above 0,
    /// without torque limits.
    ///
    /// # Errors
    /// [`ControlError::Length`], [`ControlError::BadValue`] and the others of
    /// [`ControllerConfig::validate`].
    pub fn for_inertia(&self, inertia_kg_m2: &[f64]) -> Result<ControllerConfig, ControlError> {
        let check = |key, values: &[f64]| check_values(key, values, inertia_kg_m2.len());
        let joints = match self {
            Self::Cabinet { joints, rescale_to_inertia_kg_m2, .. } => {
                let count = joints.len();
                if count != inertia_kg_m2.len() {
                    let expected = inertia_kg_m2.len();
                    return Err(ControlError::Length { key: "joints", expected, found: count });
                }
                match rescale_to_inertia_kg_m2 {
                    None => joints.clone(),
                    Some(tuned_for) => {
                        check("rescale_to_inertia_kg_m2", tuned_for)?;
                        let factors = inertia_kg_m2.iter().zip(tuned_for).map(|(j, t)| j / t);
                        joints.iter().zip(factors).map(|(joint, f)| joint.scaled(f)).collect()
                    }
                }
            }
            Self::Bandwidth { bandwidth_hz, damping, acceleration_feed_forward, .. } => {
                check("bandwidth_hz", bandwidth_hz)?;
                check("damping", &vec![*damping; inertia_kg_m2.len()])?;
                inertia_kg_m2
                    .iter()
                    .zip(bandwidth_hz)
                    .map(|(inertia, bandwidth): (&f64, &f64)| {
                        let omega = TAU * bandwidth;
                        let law = ControlLaw::Pd {
                            kp_per_rad: omega * omega,
                            kd_s_per_rad: 2.0 * damping * omega,
                            k_tau_nm: *inertia,
                        };
                        let share = if *acceleration_feed_forward { *inertia } else { 0.0 };
                        let feed_forward =
                            FeedForward { acceleration_kg_m2: share, velocity_nm_s_per_rad: 0.0 };
                        JointController { law, feed_forward, torque_limit_nm: None }
                    })
                    .collect()
            }
        };
        let config = ControllerConfig { timing: self.timing(), joints }.without_torque_limits();
        config.validate()?;
        Ok(config)
    }
}

/// Checks for one finite, positive value per joint.
fn check_values(key: &'static str, values: &[f64], expected: usize) -> Result<(), ControlError> {
    let count = values.len();
    if count != expected {
        return Err(ControlError::Length { key, expected, found: count });
    }
    match values.iter().enumerate().find(|(_, value)| !(value.is_finite() && **value > 0.0)) {
        None => Ok(()),
        Some((joint, &value)) => {
            let joint = JointIndex::new(joint);
            Err(ControlError::BadValue { joint, key, value, expected: "finite and positive" })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: ControlTiming =
        ControlTiming::Sampled { sample_period_s: 1e-3, computation_delay_s: 0.0 };

    fn cabinet(rescale_to_inertia_kg_m2: Option<Vec<f64>>) -> SimulatedController {
        let joint = JointController {
            law: ControlLaw::Pd { kp_per_rad: 100.0, kd_s_per_rad: 2.0, k_tau_nm: 3.0 },
            feed_forward: FeedForward { acceleration_kg_m2: 0.5, velocity_nm_s_per_rad: 0.25 },
            torque_limit_nm: Some(10.0),
        };
        SimulatedController::Cabinet {
            timing: TIMING,
            joints: vec![joint],
            rescale_to_inertia_kg_m2,
        }
    }

    /// Half the inertia with half the gains gives the same closed loop.
    #[test]
    #[allow(clippy::float_cmp, reason = "factors that are exact in binary")]
    fn rescaled_gains_follow_the_inertia_and_fixed_ones_do_not() {
        let scaled = cabinet(Some(vec![4.0])).for_inertia(&[2.0]).unwrap();
        let joint = &scaled.joints[0];
        let law = ControlLaw::Pd { kp_per_rad: 100.0, kd_s_per_rad: 2.0, k_tau_nm: 1.5 };
        assert_eq!((joint.law, joint.torque_limit_nm), (law, None));
        assert_eq!(joint.feed_forward.acceleration_kg_m2, 0.25);
        assert_eq!(joint.feed_forward.velocity_nm_s_per_rad, 0.125);
        let fixed = cabinet(None).for_inertia(&[2.0]).unwrap();
        let law = ControlLaw::Pd { kp_per_rad: 100.0, kd_s_per_rad: 2.0, k_tau_nm: 3.0 };
        assert_eq!((fixed.joints[0].law, fixed.joints[0].torque_limit_nm), (law, None));
    }

    #[test]
    fn lists_and_values_that_do_not_fit_are_named() {
        let error = cabinet(Some(vec![1.0, 1.0])).for_inertia(&[2.0]).unwrap_err();
        let key = "rescale_to_inertia_kg_m2";
        assert_eq!(error, ControlError::Length { key, expected: 1, found: 2 });
        assert!(cabinet(Some(vec![0.0])).for_inertia(&[2.0]).is_err());
        let error = cabinet(None).for_inertia(&[2.0, 3.0]).unwrap_err();
        assert_eq!(error, ControlError::Length { key: "joints", expected: 2, found: 1 });
        let unstable = SimulatedController::Bandwidth {
            timing: TIMING,
            bandwidth_hz: vec![10.0],
            damping: f64::NAN,
            acceleration_feed_forward: false,
        };
        let message = unstable.for_inertia(&[1.0]).unwrap_err().to_string();
        assert!(message.contains("damping"), "{message}");
    }

    #[test]
    fn files_state_every_physical_value() {
        let good = "kind = 'bandwidth'\ntiming = { kind = 'continuous', sample_period_s = 2e-4 }\n\
                    bandwidth_hz = [10.0]\ndamping = 0.8\nacceleration_feed_forward = true\n";
        toml::from_str::<SimulatedController>(good).unwrap();
        for bad in [
            good.replace("damping = 0.8\n", ""),
            good.replace("acceleration_feed_forward = true\n", ""),
            good.replace("damping", "dampening"),
            good.replace("'bandwidth'", "'cabinet'"),
        ] {
            assert!(toml::from_str::<SimulatedController>(&bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_bandwidth_takes_a_factor_that_is_one() {
        let loop_of = |hz: f64| SimulatedController::Bandwidth {
            timing: TIMING,
            bandwidth_hz: vec![hz, 2.0 * hz],
            damping: 0.8,
            acceleration_feed_forward: false,
        };
        assert_eq!(loop_of(10.0).with_bandwidth(3.0).unwrap(), loop_of(30.0));
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            for controller in [loop_of(10.0), cabinet(None)] {
                let error = controller.with_bandwidth(factor).unwrap_err();
                assert!(matches!(error, ControlError::Bandwidth { .. }), "{error}");
            }
        }
    }
}
