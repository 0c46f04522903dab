//! Which friction terms an arm has, and how Coulomb friction changes its sign.

use serde::Deserialize;

use crate::numeric::Scalar;

/// The function that stands for sign(v) in Coulomb friction.
///
/// Widths and thresholds apply to joint-side speeds: rad/s at a revolute joint, and the same
/// number of m/s at a prismatic one.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawSignModel")]
pub enum SignModel {
    /// −1, 0 or 1: the textbook's law, which takes the sign of noise at rest.
    Sign,
    /// The sign from a threshold on, 0 below it: for recordings with idle parts.
    DeadBand {
        /// Speed below which there is no friction \[rad/s\].
        threshold_rad_s: f64,
    },
    /// tanh(v / width): smooth, for simulations.
    Tanh {
        /// Speed at which friction has reached 76 % \[rad/s\].
        width_rad_s: f64,
    },
}

impl SignModel {
    /// The model's value at a speed.
    #[inline(always)]
    pub fn value<T: Scalar>(self, speed: T) -> T {
        match self {
            Self::Sign => speed.sign(),
            Self::DeadBand { threshold_rad_s } => speed.dead_band_sign(threshold_rad_s),
            Self::Tanh { width_rad_s } => (speed / T::constant(width_rad_s)).tanh(),
        }
    }

    /// How the model's value grows with the speed, where it is `value`; 0 where it jumps.
    pub(crate) fn slope(self, value: f64) -> f64 {
        match self {
            Self::Tanh { width_rad_s } => (1.0 - value * value) / width_rad_s,
            Self::Sign | Self::DeadBand { .. } => 0.0,
        }
    }

    /// The model's values in place of several speeds.
    #[inline(always)]
    pub(crate) fn replace<T: Scalar>(self, speeds: &mut [T]) {
        match self {
            Self::Tanh { width_rad_s } => {
                let width = T::constant(width_rad_s);
                for speed in &mut *speeds {
                    *speed = *speed / width;
                }
                T::tanh_each(speeds);
            }
            Self::Sign | Self::DeadBand { .. } => {
                for speed in speeds {
                    *speed = self.value(*speed);
                }
            }
        }
    }
}

/// Which friction terms every joint has: τ_f = fv q̇ + fc sign(q̇) + off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrictionTerms {
    /// `fv`: proportional to speed.
    pub viscous: bool,
    /// `fc`: of constant size, against the motion.
    pub coulomb: bool,
    /// `off`: constant, from unequal friction in both directions and the drive's current offset.
    pub offset: bool,
}

/// The sign model as written in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSignModel {
    model: String,
    threshold_rad_s: Option<f64>,
    width_rad_s: Option<f64>,
}

impl TryFrom<RawSignModel> for SignModel {
    type Error = String;

    fn try_from(raw: RawSignModel) -> Result<Self, String> {
        let positive = |key: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(value)
            } else {
                Err(format!("`{key}` is {value}; give a positive speed in rad/s"))
            }
        };
        match (raw.model.as_str(), raw.threshold_rad_s, raw.width_rad_s) {
            ("sign", None, None) => Ok(Self::Sign),
            ("dead-band", Some(threshold), None) => {
                Ok(Self::DeadBand { threshold_rad_s: positive("threshold_rad_s", threshold)? })
            }
            ("tanh", None, Some(width)) => {
                Ok(Self::Tanh { width_rad_s: positive("width_rad_s", width)? })
            }
            ("sign", ..) => Err("the model \"sign\" has no threshold and no width".into()),
            ("dead-band", ..) => {
                Err("the model \"dead-band\" needs `threshold_rad_s` and nothing else".into())
            }
            ("tanh", ..) => Err("the model \"tanh\" needs `width_rad_s` and nothing else".into()),
            (other, ..) => Err(format!(
                "the sign model \"{other}\" does not exist; use \"sign\", \"dead-band\" or \"tanh\""
            )),
        }
    }
}
