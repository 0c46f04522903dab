//! Controller description, as it is stored in a file.

use crate::robot::JointIndex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ControlError, ControlTiming};
use crate::MAX_JOINTS;

/// Controllers of an arm, one per joint, and their timing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerConfig {
    /// Time at which the controllers compute.
    pub timing: ControlTiming,
    /// One controller per joint, in the order of the joints.
    pub joints: Vec<JointController>,
}

/// The controller of one joint: law, feed-forward and saturation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointController {
    /// The feedback law: one of the forms below. e is the position error, reference less measured.
    pub law: ControlLaw,
    /// Torque from the reference alone.
    ///
    /// If left out: none.
    #[serde(default)]
    pub feed_forward: FeedForward,
    /// The command is limited to ± this joint torque \[N·m\]. The simulations of an identification
    /// leave it out.
    ///
    /// If left out: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
}

/// Torque from the reference alone: τ_ff = `acceleration_kg_m2` · q̈_r + `velocity_nm_s_per_rad` ·
/// q̇_r.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedForward {
    /// The inertia that the feed-forward of the acceleration assumes \[kg·m²\].
    #[serde(default)]
    pub acceleration_kg_m2: f64,
    /// The viscous friction that the feed-forward of the velocity assumes \[N·m·s/rad\].
    #[serde(default)]
    pub velocity_nm_s_per_rad: f64,
}

/// A feedback law. The control signal (a current or torque demand in the drive's own unit) times
/// the torque gain K_τ \[N·m per unit\] is the joint torque.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ControlLaw {
    /// τ = K_τ Kp e
    P {
        /// Kp, the gain of the position error \[1/rad\].
        kp_per_rad: f64,
        /// Kτ, the joint torque of one unit of the control signal, a current or a torque in the
        /// drive's own unit \[N·m\].
        k_tau_nm: f64,
    },
    /// τ = K_τ (Kp e + Kd ė)
    Pd {
        /// Kp, the gain of the position error \[1/rad\].
        kp_per_rad: f64,
        /// Kd, the gain of the velocity error \[s/rad\].
        kd_s_per_rad: f64,
        /// Kτ, the joint torque of one unit of the control signal, a current or a torque in the
        /// drive's own unit \[N·m\].
        k_tau_nm: f64,
    },
    /// τ = K_τ (Kp e + Kd ė + Ki ∫e dt)
    ///
    /// Anti-windup is conditional integration: the integral keeps its value while the torque is
    /// saturated and the error would drive it deeper into saturation.
    Pid {
        /// Kp, the gain of the position error \[1/rad\].
        kp_per_rad: f64,
        /// Kd, the gain of the velocity error \[s/rad\].
        kd_s_per_rad: f64,
        /// Ki, the gain of the integral \[1/(rad·s)\].
        ki_per_rad_s: f64,
        /// Kτ, the joint torque of one unit of the control signal, a current or a torque in the
        /// drive's own unit \[N·m\].
        k_tau_nm: f64,
        /// The integral keeps its value while |e| is below this, against hunting under Coulomb
        /// friction \[rad\]; at 0 it always integrates.
        #[serde(default)]
        integral_dead_zone_rad: f64,
    },
    /// Position P around velocity PI: v_e = Kv e + q̇_r − q̇, τ = K_τ (Kp v_e + Ki ∫v_e dt).
    ///
    /// The velocity is the backward difference of the measured position if the controller is
    /// sampled. Anti-windup is the same as in [`ControlLaw::Pid`].
    CascadedPPi {
        /// Kv, the gain of the position loop \[1/s\].
        kv_per_s: f64,
        /// Kp of the velocity loop \[s/rad\].
        kp_s_per_rad: f64,
        /// Ki of the velocity loop \[1/rad\].
        ki_per_rad: f64,
        /// Kτ, the joint torque of one unit of the control signal, a current or a torque in the
        /// drive's own unit \[N·m\].
        k_tau_nm: f64,
    },
}

impl ControllerConfig {
    /// Returns the same controllers without their torque limits. A simulation far from the true
    /// parameters needs this linear loop. A limit that the real arm never reaches would make it
    /// diverge.
    #[must_use]
    pub fn without_torque_limits(mut self) -> Self {
        for joint in &mut self.joints {
            joint.torque_limit_nm = None;
        }
        self
    }

    /// Returns the same controllers with `factor` times the bandwidth and the same shape of the
    /// response: on an inertia, their loops do the same in 1/`factor` of the time. Feed-forward,
    /// limits and timing stay.
    ///
    /// With the loop J s³ + Kd s² + Kp s + Ki = 0 the roots are `factor` times as large if Kd is
    /// multiplied by the factor, Kp by its square and Ki by its cube. In a cascade, the factors of
    /// ė, e and ∫e are Kp, Kp Kv + Ki and Ki Kv. So Kv and Kp are multiplied by the factor, Ki by
    /// its square. A P law has no damping: only its frequency is `factor` times as large.
    ///
    /// # Errors
    /// [`ControlError::Bandwidth`]: the factor must be finite and positive.
    pub fn with_bandwidth(mut self, factor: f64) -> Result<Self, ControlError> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(ControlError::Bandwidth { factor });
        }
        self.joints.iter_mut().for_each(|joint| joint.law.speed_up(factor));
        Ok(self)
    }

    /// Checks everything that the types cannot.
    ///
    /// # Errors
    /// [`ControlError`], which names the joint and the key.
    pub fn validate(&self) -> Result<(), ControlError> {
        let count = self.joints.len();
        if count == 0 || count > MAX_JOINTS {
            return Err(ControlError::JointCount { count, max: MAX_JOINTS });
        }
        self.timing.validate()?;
        self.joints.iter().enumerate().try_for_each(|(j, joint)| joint.validate(JointIndex::new(j)))
    }
}

impl ControlLaw {
    fn speed_up(&mut self, factor: f64) {
        let square = factor * factor;
        match self {
            Self::P { kp_per_rad, .. } => *kp_per_rad *= square,
            Self::Pd { kp_per_rad, kd_s_per_rad, .. } => {
                *kp_per_rad *= square;
                *kd_s_per_rad *= factor;
            }
            Self::Pid { kp_per_rad, kd_s_per_rad, ki_per_rad_s, .. } => {
                *kp_per_rad *= square;
                *kd_s_per_rad *= factor;
                *ki_per_rad_s *= square * factor;
            }
            Self::CascadedPPi { kv_per_s, kp_s_per_rad, ki_per_rad, .. } => {
                *kv_per_s *= factor;
                *kp_s_per_rad *= factor;
                *ki_per_rad *= square;
            }
        }
    }

    /// Returns the torque gain K_τ \[N·m per unit of the control signal\], which multiplies every
    /// gain.
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
    /// Returns the controller with torques `factor` times as large, except for their limit.
    #[must_use]
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        *scaled.law.torque_gain_mut() *= factor;
        scaled.feed_forward.acceleration_kg_m2 *= factor;
        scaled.feed_forward.velocity_nm_s_per_rad *= factor;
        scaled
    }

    fn validate(&self, joint: JointIndex) -> Result<(), ControlError> {
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
                [("kp_per_rad", kp_per_rad), ("k_tau_nm", k_tau_nm), NO_GAIN, NO_GAIN, NO_GAIN]
            }
            ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm } => [
                ("kp_per_rad", kp_per_rad),
                ("kd_s_per_rad", kd_s_per_rad),
                ("k_tau_nm", k_tau_nm),
                NO_GAIN,
                NO_GAIN,
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
                NO_GAIN,
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

/// Fills the list of gains for a law with fewer gains.
const NO_GAIN: (&str, f64) = ("", 0.0);

#[cfg(test)]
mod tests {
    use super::*;

    /// J s³ + Kd s² + Kp s + Ki: the coefficients are multiplied by the factor, its square and its
    /// cube.
    #[test]
    fn the_poles_of_every_law_take_the_factor_of_the_bandwidth() {
        let pid = |[kp_per_rad, kd_s_per_rad, ki_per_rad_s]: [f64; 3]| ControlLaw::Pid {
            kp_per_rad,
            kd_s_per_rad,
            ki_per_rad_s,
            k_tau_nm: 2.0,
            integral_dead_zone_rad: 0.1,
        };
        // Factors of e, ė and ∫e, without K_τ.
        let gains = |law: ControlLaw| match law {
            ControlLaw::P { kp_per_rad, .. } => [kp_per_rad, 0.0, 0.0],
            ControlLaw::Pd { kp_per_rad, kd_s_per_rad, .. } => [kp_per_rad, kd_s_per_rad, 0.0],
            ControlLaw::Pid { kp_per_rad, kd_s_per_rad, ki_per_rad_s, .. } => {
                [kp_per_rad, kd_s_per_rad, ki_per_rad_s]
            }
            ControlLaw::CascadedPPi { kv_per_s, kp_s_per_rad, ki_per_rad, .. } => {
                [kp_s_per_rad * kv_per_s + ki_per_rad, kp_s_per_rad, ki_per_rad * kv_per_s]
            }
        };
        for law in [
            ControlLaw::P { kp_per_rad: 5.0, k_tau_nm: 2.0 },
            ControlLaw::Pd { kp_per_rad: 5.0, kd_s_per_rad: 0.5, k_tau_nm: 2.0 },
            pid([5.0, 0.5, 7.0]),
            ControlLaw::CascadedPPi {
                kv_per_s: 4.0,
                kp_s_per_rad: 0.5,
                ki_per_rad: 3.0,
                k_tau_nm: 2.0,
            },
        ] {
            let mut fast = law;
            fast.speed_up(3.0);
            let [kp, kd, ki] = gains(law);
            for (found, expected) in gains(fast).into_iter().zip([9.0 * kp, 3.0 * kd, 27.0 * ki]) {
                assert!((found - expected).abs() < 1e-12, "{law:?}: {found}, not {expected}");
            }
        }
    }
}
