//! What the simulated arm does and no model knows: errors put in on purpose.

use serde::{Deserialize, Serialize};

use super::config::check_length;
use super::error::SetupError;

/// Errors of the model, each absent unless stated. The arm has them; whoever identifies it with
/// its [`Model`](crate::dynamics::Model) does not know.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Unmodelled {
    /// Additional friction at low speed, one per joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stribeck: Option<Vec<Stribeck>>,
    /// Logged torque over commanded torque, one per motor: 1.05 is a drive gain that is taken for
    /// 5 % larger than it is. The controller and the arm do not feel it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_gain: Option<Vec<f64>>,
}

/// The part of friction that falls as motion begins (Stribeck): fs exp(−(q̇/vs)²) tanh(q̇/w).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stribeck {
    /// fs, its size at low speed \[N·m, or N\]; 0 is none.
    pub torque_nm: f64,
    /// vs, the speed at which 1/e of it is left \[rad/s, or m/s\].
    pub velocity_rad_s: f64,
    /// w, the width of the change of sign \[rad/s, or m/s\]; well below vs.
    pub width_rad_s: f64,
}

impl Stribeck {
    /// The friction at a velocity, positive against a positive velocity \[N·m, or N\].
    pub fn torque(&self, velocity_rad_s: f64) -> f64 {
        let slow = velocity_rad_s / self.velocity_rad_s;
        self.torque_nm * (-slow * slow).exp() * (velocity_rad_s / self.width_rad_s).tanh()
    }
}

impl Unmodelled {
    pub(super) fn validate(&self, joints: usize) -> Result<(), SetupError> {
        if let Some(stribeck) = &self.stribeck {
            check_length("unmodelled.stribeck", joints, stribeck.len())?;
            for of_joint in stribeck {
                let (what, value) = ("unmodelled.stribeck.torque_nm", of_joint.torque_nm);
                if !(value.is_finite() && value >= 0.0) {
                    let expected = "finite and not negative";
                    return Err(SetupError::BadValue { what, value, expected });
                }
                check_positive("unmodelled.stribeck.velocity_rad_s", of_joint.velocity_rad_s)?;
                check_positive("unmodelled.stribeck.width_rad_s", of_joint.width_rad_s)?;
            }
        }
        if let Some(gains) = &self.torque_gain {
            check_length("unmodelled.torque_gain", joints, gains.len())?;
            gains.iter().try_for_each(|gain| check_positive("unmodelled.torque_gain", *gain))?;
        }
        Ok(())
    }
}

fn check_positive(what: &'static str, value: f64) -> Result<(), SetupError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SetupError::BadValue { what, value, expected: "finite and positive" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRIBECK: Stribeck = Stribeck { torque_nm: 0.7, velocity_rad_s: 0.1, width_rad_s: 0.001 };

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
        let sharp = Stribeck { width_rad_s: f64::NAN, ..STRIBECK };
        assert!(said(&stribeck(vec![sharp])).contains("width_rad_s = NaN"));
        assert!(said(&gain(vec![1.0, 1.0])).contains("unmodelled.torque_gain"));
        assert!(said(&gain(vec![0.0])).contains("unmodelled.torque_gain = 0"));
    }
}
