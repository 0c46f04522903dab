//! Law of one joint at one instant, shared by the sampled and the continuous controller.

use super::{ControlLaw, JointController};

/// Inputs of the law for one joint at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signals {
    /// e = q_r − q \[rad\].
    pub(super) error: f64,
    /// ė \[rad/s\].
    pub(super) error_rate: f64,
    /// q̇ \[rad/s\].
    pub(super) velocity: f64,
    /// q̇_r \[rad/s\].
    pub(super) reference_velocity: f64,
    /// q̈_r \[rad/s²\].
    pub(super) reference_acceleration: f64,
}

impl JointController {
    /// Returns the integrand: e for PID \[rad\], v_e for P-PI \[rad/s\], nothing otherwise.
    pub(super) fn integrand(&self, s: &Signals) -> f64 {
        match self.law {
            ControlLaw::P { .. } | ControlLaw::Pd { .. } => 0.0,
            ControlLaw::Pid { integral_dead_zone_rad, .. } => {
                if s.error.abs() < integral_dead_zone_rad { 0.0 } else { s.error }
            }
            ControlLaw::CascadedPPi { kv_per_s, .. } => {
                kv_per_s * s.error + s.reference_velocity - s.velocity
            }
        }
    }

    /// Returns the torque before saturation \[N·m\].
    pub(super) fn torque(&self, s: &Signals, integral: f64) -> f64 {
        let feedback = match self.law {
            ControlLaw::P { kp_per_rad, k_tau_nm } => k_tau_nm * (kp_per_rad * s.error),
            ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm } => {
                k_tau_nm * (kp_per_rad * s.error + kd_s_per_rad * s.error_rate)
            }
            ControlLaw::Pid { kp_per_rad, kd_s_per_rad, ki_per_rad_s, k_tau_nm, .. } => {
                k_tau_nm
                    * (kp_per_rad * s.error + kd_s_per_rad * s.error_rate + ki_per_rad_s * integral)
            }
            ControlLaw::CascadedPPi { kv_per_s, kp_s_per_rad, ki_per_rad, k_tau_nm } => {
                let velocity_error = kv_per_s * s.error + s.reference_velocity - s.velocity;
                k_tau_nm * (kp_s_per_rad * velocity_error + ki_per_rad * integral)
            }
        };
        feedback
            + self.feed_forward.acceleration_kg_m2 * s.reference_acceleration
            + self.feed_forward.velocity_nm_s_per_rad * s.reference_velocity
    }

    /// Returns true if adding `integrand` would drive a saturated torque deeper into saturation
    /// (conditional integration).
    pub(super) fn winds_up(&self, torque: f64, integrand: f64) -> bool {
        self.torque_limit_nm.is_some_and(|limit| torque.abs() > limit && torque * integrand > 0.0)
    }

    /// Returns the torque within the joint's limit \[N·m\]. NaN stays NaN, so that a divergence is
    /// visible.
    pub(super) fn saturate(&self, torque: f64) -> f64 {
        match self.torque_limit_nm {
            Some(limit) => torque.clamp(-limit, limit),
            None => torque,
        }
    }
}

/// Gains of a law. All laws are linear: τ = `error` e + `error_rate` ė + `velocity` q̇ + `integral`
/// I, and İ = `integrand_error` e + `integrand_velocity` q̇. Terms of the reference alone are not
/// included.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) error: f64,
    pub(super) error_rate: f64,
    pub(super) velocity: f64,
    pub(super) integral: f64,
    pub(super) integrand_error: f64,
    pub(super) integrand_velocity: f64,
    /// The integral keeps its value while |e| is below this \[rad\].
    dead_zone_rad: f64,
}

impl Gains {
    pub(super) fn from_controller(controller: &JointController) -> Self {
        let rest = Signals {
            error: 0.0,
            error_rate: 0.0,
            velocity: 0.0,
            reference_velocity: 0.0,
            reference_acceleration: 0.0,
        };
        let (integrand_error, integrand_velocity, dead_zone_rad) = match controller.law {
            ControlLaw::P { .. } | ControlLaw::Pd { .. } => (0.0, 0.0, 0.0),
            ControlLaw::Pid { integral_dead_zone_rad, .. } => (1.0, 0.0, integral_dead_zone_rad),
            ControlLaw::CascadedPPi { kv_per_s, .. } => (kv_per_s, -1.0, 0.0),
        };
        Self {
            error: controller.torque(&Signals { error: 1.0, ..rest }, 0.0),
            error_rate: controller.torque(&Signals { error_rate: 1.0, ..rest }, 0.0),
            velocity: controller.torque(&Signals { velocity: 1.0, ..rest }, 0.0),
            integral: controller.torque(&rest, 1.0),
            integrand_error,
            integrand_velocity,
            dead_zone_rad,
        }
    }

    /// Returns true if the integral changes at this error \[rad\].
    pub(super) fn integrates(&self, error: f64) -> bool {
        error.abs() >= self.dead_zone_rad
    }
}
