//! Which friction terms an arm has, and how they follow from the speed.

use serde::Deserialize;

use super::ParameterKind;
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

/// Which of the usual friction terms every joint has: τ_f = fv q̇ + fc sign(q̇) + off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrictionTerms {
    /// `fv`: proportional to speed.
    pub viscous: bool,
    /// `fc`: of constant size, against the motion.
    pub coulomb: bool,
    /// `off`: constant, from unequal friction in both directions and the drive's current offset.
    pub offset: bool,
}

/// What the friction of one joint has besides: its own law for the sign, and further terms.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFriction {
    /// The law for the sign of Coulomb friction.
    pub sign: SignModel,
    /// Terms beside the usual ones, each at most once, in the order of [`FrictionLaw::kind`].
    pub laws: Vec<FrictionLaw>,
}

/// A friction term beside the usual ones: its coefficient is a parameter, its shape is stated.
///
/// Unequal Coulomb friction in the two directions is no term of its own: fc⁺ and fc⁻ are fc and
/// `off` while the joint moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrictionLaw {
    /// `fvq` q̇·|q̇|: viscous friction that bends, as that of grease which warms in the gap.
    Quadratic,
    /// `fvc` q̇³.
    Cubic,
    /// `fva` |q̇|: viscous friction that differs by direction, fv ± fva.
    Asymmetric,
    /// `fs` exp(−(q̇/vs)²) sign(q̇): what falls as motion begins (Bo and Pavelescu 1982, δ = 2).
    Stribeck {
        /// vs \[rad/s or m/s\].
        speed_rad_s: f64,
    },
}

impl FrictionLaw {
    /// Its coefficient.
    pub fn kind(self) -> ParameterKind {
        match self {
            Self::Quadratic => ParameterKind::FvQuadratic,
            Self::Cubic => ParameterKind::FvCubic,
            Self::Asymmetric => ParameterKind::FvAsymmetric,
            Self::Stribeck { .. } => ParameterKind::Fs,
        }
    }

    /// The torque per unit of its coefficient at a speed.
    #[inline(always)]
    pub fn value<T: Scalar>(self, speed: T, sign: SignModel) -> T {
        match self {
            Self::Quadratic => speed * magnitude(speed),
            Self::Cubic => speed * speed * speed,
            Self::Asymmetric => magnitude(speed),
            Self::Stribeck { speed_rad_s } => bell(speed, speed_rad_s) * sign.value(speed),
        }
    }

    /// How the value grows with the speed; 0 where it jumps.
    pub(crate) fn slope(self, speed: f64, sign: SignModel) -> f64 {
        match self {
            Self::Quadratic => 2.0 * speed.abs(),
            Self::Cubic => 3.0 * speed * speed,
            Self::Asymmetric => Scalar::sign(speed),
            Self::Stribeck { speed_rad_s } => {
                let (bell, value) = (bell(speed, speed_rad_s), sign.value(speed));
                let falls = -2.0 * speed / (speed_rad_s * speed_rad_s) * bell;
                falls * value + bell * sign.slope(value)
            }
        }
    }
}

fn magnitude<T: Scalar>(speed: T) -> T {
    speed * speed.sign()
}

/// exp(−(v/vs)²), by (1 − t)/(1 + t) with t = tanh(½ (v/vs)²).
#[inline(always)]
fn bell<T: Scalar>(speed: T, width: f64) -> T {
    let x = speed / T::constant(width);
    let t = (T::constant(0.5) * x * x).tanh();
    (T::constant(1.0) - t) / (T::constant(1.0) + t)
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIGN: SignModel = SignModel::Tanh { width_rad_s: 0.1 };
    const LAWS: [FrictionLaw; 4] = [
        FrictionLaw::Quadratic,
        FrictionLaw::Cubic,
        FrictionLaw::Asymmetric,
        FrictionLaw::Stribeck { speed_rad_s: 0.3 },
    ];

    #[test]
    fn laws_have_their_values_and_slopes() {
        let formulas: [fn(f64) -> f64; 4] = [
            |v| v * v.abs(),
            |v| v.powi(3),
            f64::abs,
            |v| (-(v / 0.3).powi(2)).exp() * (v / 0.1).tanh(),
        ];
        for (law, formula) in LAWS.into_iter().zip(formulas) {
            for v in [-3.0, -0.4, -0.02, 0.01, 0.15, 0.6, 5.0] {
                let value = law.value(v, SIGN);
                assert!(
                    (value - formula(v)).abs() < 1e-15 * (1.0 + v.abs().powi(3)),
                    "{law:?} {v}"
                );
                let h = 1e-6;
                let slope = (law.value(v + h, SIGN) - law.value(v - h, SIGN)) / (2.0 * h);
                assert!(
                    (law.slope(v, SIGN) - slope).abs() < 1e-8 * (1.0 + slope.abs()),
                    "{law:?} {v}"
                );
            }
            assert!(law.value(0.0, SIGN).abs() < f64::MIN_POSITIVE, "{law:?}");
        }
    }
}
