//! Unmodelled effects of the simulated arm, added on purpose.

use serde::{Deserialize, Serialize};

use super::checked::{check_length, check_not_negative, check_positive};
use super::error::SetupError;
use super::flexible::{self, FlexibleMode};
use super::hysteresis::{self, MaxwellSlip};

/// Model errors, each absent unless configured. The simulated arm has them; its
/// [`Model`](crate::dynamics::Model) does not.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Unmodelled {
    /// Additional friction at low speed, one per joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stribeck: Option<Vec<Stribeck>>,
    /// w of the arm's Coulomb friction, fc tanh(q̇/w), in place of the model's own sign function
    /// \[rad/s, or m/s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coulomb_width_rad_s: Option<f64>,
    /// Coulomb friction that grows with the load, one per joint: this share of |τ|, where τ is the
    /// torque that the joint's links and rotor need \[1\]; 0 to below 1. The sign is that of the
    /// joint's Coulomb friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_friction: Option<Vec<f64>>,
    /// Friction hysteresis at reversals, in addition to the model's friction, one element per
    /// joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Vec<MaxwellSlip>>,
    /// Joints that are not rigid, one mode per joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flexible: Option<Vec<FlexibleMode>>,
    /// Torque ripple, one per motor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cogging: Option<Vec<Cogging>>,
    /// Logged torque over commanded torque, one per motor: 1.05 means that the configured drive
    /// gain is 5 % too large. Controller and arm are not affected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_gain: Option<Vec<f64>>,
}

/// The part of friction that falls as motion begins (Stribeck): fs exp(−(q̇/vs)²) tanh(q̇/w).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stribeck {
    /// fs, its size at low speed \[N·m, or N\]; 0 is none.
    pub torque_nm: f64,
    /// vs, the speed at which it has fallen to 1/e \[rad/s, or m/s\].
    pub velocity_rad_s: f64,
    /// w, the width of the change of sign \[rad/s, or m/s\]; well below vs.
    #[serde(rename = "width_rad_s")]
    pub sign_width_rad_s: f64,
}

/// Torque ripple of a motor over its angle, a sin(p q_m + ϕ): cogging, which does not depend on the
/// current.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cogging {
    /// a, on the motor side \[N·m\]; 0 is none.
    pub torque_nm: f64,
    /// p, periods in one turn of the motor: pole pairs and their multiples.
    pub periods_per_turn: u32,
    /// ϕ \[rad\].
    pub phase_rad: f64,
}

impl Cogging {
    /// Returns the torque on the motor at this angle \[N·m\].
    pub fn torque(&self, motor_position_rad: f64) -> f64 {
        let angle = f64::from(self.periods_per_turn) * motor_position_rad + self.phase_rad;
        self.torque_nm * angle.sin()
    }
}

impl Stribeck {
    /// Returns the friction at a velocity, positive against a positive velocity \[N·m, or N\].
    pub fn torque(&self, velocity_rad_s: f64) -> f64 {
        let slow = velocity_rad_s / self.velocity_rad_s;
        self.torque_nm * (-slow * slow).exp() * (velocity_rad_s / self.sign_width_rad_s).tanh()
    }
}

impl Unmodelled {
    pub(super) fn validate(&self, joints: usize) -> Result<(), SetupError> {
        if let Some(stribeck) = &self.stribeck {
            check_length("unmodelled.stribeck", joints, stribeck.len())?;
            for of_joint in stribeck {
                check_not_negative("unmodelled.stribeck.torque_nm", of_joint.torque_nm)?;
                check_positive("unmodelled.stribeck.velocity_rad_s", of_joint.velocity_rad_s)?;
                check_positive("unmodelled.stribeck.width_rad_s", of_joint.sign_width_rad_s)?;
            }
        }
        if let Some(width) = self.coulomb_width_rad_s {
            check_positive("unmodelled.coulomb_width_rad_s", width)?;
        }
        if let Some(shares) = &self.load_friction {
            check_length("unmodelled.load_friction", joints, shares.len())?;
            for &value in shares {
                if !(0.0..1.0).contains(&value) {
                    let (what, expected) = ("unmodelled.load_friction", "0 or more and below 1");
                    return Err(SetupError::BadValue { what, value, expected });
                }
            }
        }
        if let Some(elements) = &self.hysteresis {
            hysteresis::validate(elements, joints)?;
        }
        if let Some(modes) = &self.flexible {
            flexible::validate(modes, joints)?;
        }
        if let Some(cogging) = &self.cogging {
            check_length("unmodelled.cogging", joints, cogging.len())?;
            for of_motor in cogging {
                check_not_negative("unmodelled.cogging.torque_nm", of_motor.torque_nm)?;
                let (what, value) = ("unmodelled.cogging.phase_rad", of_motor.phase_rad);
                if !value.is_finite() {
                    return Err(SetupError::BadValue { what, value, expected: "finite" });
                }
            }
        }
        if let Some(gains) = &self.torque_gain {
            check_length("unmodelled.torque_gain", joints, gains.len())?;
            gains.iter().try_for_each(|gain| check_positive("unmodelled.torque_gain", *gain))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRIBECK: Stribeck =
        Stribeck { torque_nm: 0.7, velocity_rad_s: 0.1, sign_width_rad_s: 0.001 };

    #[test]
    fn stribeck_friction_opposes_the_motion_and_fades_with_speed() {
        assert!(STRIBECK.torque(0.0).abs() < f64::EPSILON);
        // Far above w and at vs: fs/e, odd in the velocity.
        let expected = 0.7 / core::f64::consts::E;
        assert!((STRIBECK.torque(0.1) - expected).abs() < 1e-12);
        assert!((STRIBECK.torque(-0.1) + expected).abs() < 1e-12);
        assert!(STRIBECK.torque(1.0) < 1e-40);
    }

    #[test]
    fn what_makes_no_sense_is_refused_by_name() {
        let said = |unmodelled: &Unmodelled| match unmodelled.validate(1) {
            Ok(()) => String::new(),
            Err(error) => error.to_string(),
        };
        let stribeck = |of_joint| Unmodelled { stribeck: Some(of_joint), ..Default::default() };
        let gain = |gains| Unmodelled { torque_gain: Some(gains), ..Default::default() };
        assert_eq!(said(&stribeck(vec![STRIBECK])), "");
        assert_eq!(said(&gain(vec![1.05])), "");
        assert!(said(&stribeck(vec![])).contains("unmodelled.stribeck"));
        let negative = Stribeck { torque_nm: -1.0, ..STRIBECK };
        assert!(said(&stribeck(vec![negative])).contains("torque_nm = -1"));
        let still = Stribeck { velocity_rad_s: 0.0, ..STRIBECK };
        assert!(said(&stribeck(vec![still])).contains("velocity_rad_s = 0"));
        let sharp = Stribeck { sign_width_rad_s: f64::NAN, ..STRIBECK };
        assert!(said(&stribeck(vec![sharp])).contains("width_rad_s = NaN"));
        assert!(said(&gain(vec![1.0, 1.0])).contains("unmodelled.torque_gain"));
        assert!(said(&gain(vec![0.0])).contains("unmodelled.torque_gain = 0"));
        let width = |w| Unmodelled { coulomb_width_rad_s: Some(w), ..Default::default() };
        assert_eq!(said(&width(0.1)), "");
        assert!(said(&width(0.0)).contains("coulomb_width_rad_s = 0"));
        let load = |shares| Unmodelled { load_friction: Some(shares), ..Default::default() };
        assert_eq!(said(&load(vec![0.02])), "");
        assert!(said(&load(vec![])).contains("unmodelled.load_friction"));
        assert!(said(&load(vec![1.0])).contains("load_friction = 1"));
        assert!(said(&load(vec![-0.1])).contains("load_friction = -0.1"));
        let slip = MaxwellSlip { torque_nm: 1.0, stiffness_nm_rad: 500.0 };
        let lagging = |elements| Unmodelled { hysteresis: Some(elements), ..Default::default() };
        assert_eq!(said(&lagging(vec![slip])), "");
        assert!(said(&lagging(vec![])).contains("unmodelled.hysteresis"));
        let driving = MaxwellSlip { torque_nm: -1.0, ..slip };
        assert!(said(&lagging(vec![driving])).contains("torque_nm = -1"));
        let loose = MaxwellSlip { stiffness_nm_rad: 0.0, ..slip };
        assert!(said(&lagging(vec![loose])).contains("stiffness_nm_rad = 0"));
        let mode = FlexibleMode { frequency_hz: 20.0, damping_ratio: 0.0, inertia_kg_m2: 0.1 };
        let flexible = |modes| Unmodelled { flexible: Some(modes), ..Default::default() };
        assert_eq!(said(&flexible(vec![mode])), "");
        assert!(said(&flexible(vec![])).contains("unmodelled.flexible"));
        let stiff = FlexibleMode { frequency_hz: f64::INFINITY, ..mode };
        assert!(said(&flexible(vec![stiff])).contains("frequency_hz = inf"));
        let driven = FlexibleMode { damping_ratio: -0.1, ..mode };
        assert!(said(&flexible(vec![driven])).contains("damping_ratio = -0.1"));
        let light = FlexibleMode { inertia_kg_m2: -1.0, ..mode };
        assert!(said(&flexible(vec![light])).contains("inertia_kg_m2 = -1"));
        let ripple = Cogging { torque_nm: 0.01, periods_per_turn: 6, phase_rad: 0.0 };
        let cogging = |of_motors| Unmodelled { cogging: Some(of_motors), ..Default::default() };
        assert_eq!(said(&cogging(vec![ripple])), "");
        assert!(said(&cogging(vec![ripple; 2])).contains("unmodelled.cogging"));
        let nowhere = Cogging { phase_rad: f64::NAN, ..ripple };
        assert!(said(&cogging(vec![nowhere])).contains("phase_rad = NaN"));
        let backward = Cogging { torque_nm: -0.01, ..ripple };
        assert!(said(&cogging(vec![backward])).contains("torque_nm = -0.01"));
    }
}
