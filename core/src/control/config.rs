//! What a controller is, as it stands in a file.

use serde::{Deserialize, Serialize};

use super::ControlError;
use crate::MAX_JOINTS;

/// The controllers of an arm, one per joint, and when they compute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerConfig {
    /// When the controllers compute.
    pub timing: ControlTiming,
    /// One controller per joint, in the order of the joints.
    pub joints: Vec<JointController>,
}

/// When a controller computes and how long its command acts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ControlTiming {
    /// Once per period from the position measured at t_k; the torque is held for one period. The
    /// derivative is the backward difference of the error, ė_k = (e_k − e_{k−1}) / T.
    Sampled {
        /// Period T \[s\].
        sample_period_s: f64,
        /// Time from the measurement at t_k to the instant its command begins to act \[s\]; it
        /// then acts for one period. 0, the default: from t_k to t_{k+1}.
        #[serde(default)]
        computation_delay_s: f64,
    },
    /// At every instant, from the true position and velocity; no quantisation, no hold.
    Continuous {
        /// Period at which the loop is recorded \[s\].
        sample_period_s: f64,
    },
}

/// The controller of one joint: law, feed-forward and saturation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointController {
    /// The feedback law.
    pub law: ControlLaw,
    /// Torque added from the reference alone; none when absent.
    #[serde(default)]
    pub feed_forward: FeedForward,
    /// The command is limited to ± this joint torque \[N·m\]; no limit when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
}

/// Torque from the reference alone: τ_ff = `acceleration_kg_m2` · q̈_r + `velocity_nm_s_per_rad` · q̇_r.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedForward {
    /// Inertia that the acceleration feed-forward assumes \[kg·m²\].
    #[serde(default)]
    pub acceleration_kg_m2: f64,
    /// Viscous friction that the velocity feed-forward assumes \[N·m·s/rad\].
    #[serde(default)]
    pub velocity_nm_s_per_rad: f64,
}

/// A feedback law. The control signal (a current or torque demand in the drive's own unit) times
/// the torque gain K_τ \[N·m per unit\] is the joint torque.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ControlLaw {
    /// τ = K_τ Kp e
    P {
        /// Kp \[1/rad\].
        kp_per_rad: f64,
        /// K_τ \[N·m\].
        k_tau_nm: f64,
    },
    /// τ = K_τ (Kp e + Kd ė)
    Pd {
        /// Kp \[1/rad\].
        kp_per_rad: f64,
        /// Kd \[s/rad\].
        kd_s_per_rad: f64,
        /// K_τ \[N·m\].
        k_tau_nm: f64,
    },
    /// τ = K_τ (Kp e + Kd ė + Ki ∫e dt)
    ///
    /// Anti-windup is conditional integration: the integral keeps its value while the torque is
    /// saturated and the error would drive it deeper into saturation.
    Pid {
        /// Kp \[1/rad\].
        kp_per_rad: f64,
        /// Kd \[s/rad\].
        kd_s_per_rad: f64,
        /// Ki \[1/(rad·s)\].
        ki_per_rad_s: f64,
        /// K_τ \[N·m\].
        k_tau_nm: f64,
        /// The integral keeps its value while |e| is below this \[rad\], against hunting under
        /// Coulomb friction; 0, the default, integrates always.
        #[serde(default)]
        integral_dead_zone_rad: f64,
    },
    /// Position P around velocity PI: v_e = Kv e + q̇_r − q̇, τ = K_τ (Kp v_e + Ki ∫v_e dt).
    ///
    /// The velocity is the backward difference of the measured position where the controller is
    /// sampled. Anti-windup as in [`ControlLaw::Pid`].
    CascadedPPi {
        /// Kv, the position loop's gain \[1/s\].
        kv_per_s: f64,
        /// Kp of the velocity loop \[s/rad\].
        kp_s_per_rad: f64,
        /// Ki of the velocity loop \[1/rad\].
        ki_per_rad: f64,
        /// K_τ \[N·m\].
        k_tau_nm: f64,
    },
}

impl ControllerConfig {
    /// The same controllers without their torque limits: the linear loop that a simulation far
    /// from the true parameters needs, where a limit that the real arm never reaches would make it
    /// diverge.
    #[must_use]
    pub fn without_torque_limits(mut self) -> Self {
        for joint in &mut self.joints {
            joint.torque_limit_nm = None;
        }
        self
    }

    /// Checks everything that the types cannot.
    ///
    /// # Errors
    /// [`ControlError`] names the joint and the key.
    pub fn validate(&self) -> Result<(), ControlError> {
        let count = self.joints.len();
        if count == 0 || count > MAX_JOINTS {
            return Err(ControlError::JointCount { count, max: MAX_JOINTS });
        }
        self.timing.validate()?;
        self.joints.iter().enumerate().try_for_each(|(j, joint)| joint.validate(j + 1))
    }
}

impl ControlTiming {
    /// Period of the samples \[s\].
    pub fn sample_period_s(self) -> f64 {
        match self {
            Self::Sampled { sample_period_s, .. } | Self::Continuous { sample_period_s } => {
                sample_period_s
            }
        }
    }

    /// The mean time of the piece of torque that acts just after a sample, relative to the sample
    /// \[s\]. A command acts for one period T; just after a sample it still acts for the rest of its
    /// delay, or for a whole period where nothing is left: the mean is that end less T/2. A
    /// continuous controller's torque just after a sample is that of the sample itself.
    pub fn mean_time_after_sample_s(self) -> f64 {
        match self {
            Self::Continuous { .. } => 0.0,
            Self::Sampled { sample_period_s, computation_delay_s } => {
                let (_, rest_s) = split_delay(computation_delay_s, sample_period_s);
                let end_s = if rest_s > 0.0 { rest_s } else { sample_period_s };
                end_s - 0.5 * sample_period_s
            }
        }
    }

    fn validate(self) -> Result<(), ControlError> {
        let sample_period_s = self.sample_period_s();
        let computation_delay_s = match self {
            Self::Sampled { computation_delay_s, .. } => computation_delay_s,
            Self::Continuous { .. } => 0.0,
        };
        if !(sample_period_s.is_finite() && sample_period_s > 0.0) {
            return Err(ControlError::BadTiming {
                key: "sample_period_s",
                value: sample_period_s,
                expected: "finite and positive",
            });
        }
        // A delay of many periods is a mistake of units, and the commands under way take memory.
        if !(0.0..=16.0 * sample_period_s).contains(&computation_delay_s) {
            return Err(ControlError::BadTiming {
                key: "computation_delay_s",
                value: computation_delay_s,
                expected: "between 0 and 16 sample periods",
            });
        }
        Ok(())
    }
}

impl ControlLaw {
    /// The torque gain K_τ \[N·m per unit of the control signal\], which multiplies every gain.
    fn torque_gain_mut(&mut self) -> &mut f64 {
        match self {
            Self::P { k_tau_nm, .. }
            | Self::Pd { k_tau_nm, .. }
            | Self::Pid { k_tau_nm, .. }
            | Self::CascadedPPi { k_tau_nm, .. } => k_tau_nm,
        }
    }
}

impl JointController {
    /// The controller whose torques, but for their limit, are `factor` times as large.
    #[must_use]
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        *scaled.law.torque_gain_mut() *= factor;
        scaled.feed_forward.acceleration_kg_m2 *= factor;
        scaled.feed_forward.velocity_nm_s_per_rad *= factor;
        scaled
    }

    fn validate(&self, joint: usize) -> Result<(), ControlError> {
        let not_negative = |key, value: f64| {
            if value.is_finite() && value >= 0.0 {
                Ok(())
            } else {
                let expected = "finite and not negative";
                Err(ControlError::BadValue { joint, key, value, expected })
            }
        };
        let gains: [(&'static str, f64); 5] = match self.law {
            ControlLaw::P { kp_per_rad, k_tau_nm } => {
                [("kp_per_rad", kp_per_rad), ("k_tau_nm", k_tau_nm), NONE, NONE, NONE]
            }
            ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm } => [
                ("kp_per_rad", kp_per_rad),
                ("kd_s_per_rad", kd_s_per_rad),
                ("k_tau_nm", k_tau_nm),
                NONE,
                NONE,
            ],
            ControlLaw::Pid {
                kp_per_rad,
                kd_s_per_rad,
                ki_per_rad_s,
                k_tau_nm,
                integral_dead_zone_rad,
            } => [
                ("kp_per_rad", kp_per_rad),
                ("kd_s_per_rad", kd_s_per_rad),
                ("ki_per_rad_s", ki_per_rad_s),
                ("k_tau_nm", k_tau_nm),
                ("integral_dead_zone_rad", integral_dead_zone_rad),
            ],
            ControlLaw::CascadedPPi { kv_per_s, kp_s_per_rad, ki_per_rad, k_tau_nm } => [
                ("kv_per_s", kv_per_s),
                ("kp_s_per_rad", kp_s_per_rad),
                ("ki_per_rad", ki_per_rad),
                ("k_tau_nm", k_tau_nm),
                NONE,
            ],
        };
        gains.into_iter().try_for_each(|(key, value)| not_negative(key, value))?;
        not_negative("acceleration_kg_m2", self.feed_forward.acceleration_kg_m2)?;
        not_negative("velocity_nm_s_per_rad", self.feed_forward.velocity_nm_s_per_rad)?;
        match self.torque_limit_nm {
            Some(value) if !(value.is_finite() && value > 0.0) => Err(ControlError::BadValue {
                joint,
                key: "torque_limit_nm",
                value,
                expected: "finite and positive",
            }),
            _ => Ok(()),
        }
    }
}

/// Fills the list of gains of a law that has fewer.
const NONE: (&str, f64) = ("", 0.0);

/// A delay as whole periods and the rest of one \[s\]; a rest within rounding of a whole period is
/// none.
pub(crate) fn split_delay(delay_s: f64, period_s: f64) -> (usize, f64) {
    let periods = delay_s / period_s;
    let whole = (periods + 1e-9).floor();
    let rest = periods - whole;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the controller's validation keeps the delay within 16 periods"
    )]
    let whole = whole as usize;
    (whole, if rest < 1e-9 { 0.0 } else { rest * period_s })
}
