//! Friction terms of an arm, and their dependence on the speed.

use core::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Joint, ParameterKind};
use crate::numeric::Scalar;

/// Function that represents sign(v) in Coulomb friction.
///
/// Widths and thresholds apply to joint-side speeds: rad/s at a revolute joint, and the same number
/// of m/s at a prismatic one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "RawSignModel", into = "RawSignModel")]
#[schemars(!try_from, !into, tag = "model", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SignModel {
    /// −1, 0 or 1: the textbook law. At rest it takes the sign of the noise.
    Sign,
    /// The sign of speeds from a threshold on, 0 below it: for recordings with parts at rest.
    DeadBand {
        /// The speed of the joint below which there is no friction \[rad/s\]; greater than 0. For a
        /// prismatic joint it is in m/s.
        threshold_rad_s: f64,
    },
    /// tanh(v / width): smooth, for simulations.
    Tanh {
        /// The speed of the joint at which friction has reached 76 % \[rad/s\]; greater than 0. For
        /// a prismatic joint it is in m/s.
        width_rad_s: f64,
    },
}

impl SignModel {
    /// Returns the model's value at a speed.
    #[inline(always)]
    pub fn value<T: Scalar>(self, speed: T) -> T {
        match self {
            Self::Sign => speed.sign(),
            Self::DeadBand { threshold_rad_s } => speed.dead_band_sign(threshold_rad_s),
            Self::Tanh { width_rad_s } => (speed / T::constant(width_rad_s)).tanh(),
        }
    }

    /// Returns the derivative of the model's value with respect to the speed, at this value; 0 at
    /// jumps.
    pub(crate) fn slope(self, value: f64) -> f64 {
        match self {
            Self::Tanh { width_rad_s } => (1.0 - value * value) / width_rad_s,
            Self::Sign | Self::DeadBand { .. } => 0.0,
        }
    }

    /// Replaces several speeds by the model's values.
    #[inline(always)]
    pub(crate) fn replace_speeds<T: Scalar>(self, speeds: &mut [T]) {
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

/// Usual friction terms that every joint has: τ_f = fv q̇ + fc sign(q̇) + off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrictionTerms {
    /// `fv`: proportional to speed.
    pub viscous: bool,
    /// `fc`: of constant size, against the motion.
    pub coulomb: bool,
    /// `off`: constant, from unequal friction in both directions and the drive's current offset.
    pub offset: bool,
}

/// Further friction of one joint: its own law for the sign, and further terms. Shown as the table
/// of a robot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "RawJointFriction", into = "RawJointFriction")]
pub struct JointFriction {
    /// The law for the sign of Coulomb friction.
    pub sign: SignModel,
    /// Terms in addition to the usual ones, each kind at most once, in the order of their kinds.
    pub laws: Vec<FrictionLaw>,
}

impl JointFriction {
    /// Returns the presliding distance of the hysteresis term, if there is one \[rad or m\].
    pub fn presliding_distance(&self) -> Option<f64> {
        self.laws.iter().find_map(|law| match law {
            FrictionLaw::Hysteresis { way_rad } => Some(*way_rad),
            _ => None,
        })
    }

    /// Returns itself if the presliding distance is within the range of this joint, whose number
    /// counts from 1.
    pub(super) fn check_presliding_distance(
        self,
        joint: &Joint,
        number: usize,
    ) -> Result<Self, String> {
        let range = joint.limits.position_max - joint.limits.position_min;
        let unit = joint.kind.position_unit();
        match self.presliding_distance().filter(|presliding_distance| *presliding_distance >= range)
        {
            Some(route) => Err(format!(
                "`hysteresis_rad` is {route}, and joint {number} goes {range:.3} {unit} from limit \
                 to limit, over which it would never turn; give the way after a reversal, which is \
                 thousandths of that"
            )),
            None => Ok(self),
        }
    }

    /// Returns the same friction with this term; it replaces a term of the same kind.
    #[must_use]
    pub fn with_law(&self, law: FrictionLaw) -> Self {
        let mut laws = self.laws.clone();
        laws.retain(|own| own.kind() != law.kind());
        laws.push(law);
        laws.sort_by_key(|law| law.kind());
        Self { sign: self.sign, laws }
    }

    /// Returns the same friction with every speed at which it bends changed \[rad/s or m/s\].
    #[must_use]
    pub fn with_speeds(&self, change: impl Fn(f64) -> f64) -> Self {
        let sign = match self.sign {
            SignModel::Tanh { width_rad_s } => SignModel::Tanh { width_rad_s: change(width_rad_s) },
            other => other,
        };
        let changed = |law: &FrictionLaw| match *law {
            FrictionLaw::Stribeck { speed_rad_s } => {
                FrictionLaw::Stribeck { speed_rad_s: change(speed_rad_s) }
            }
            other => other,
        };
        Self { sign, laws: self.laws.iter().map(changed).collect() }
    }
}

/// A friction term in addition to the usual ones. Its coefficient is a parameter, its shape is
/// configured.
///
/// Unequal Coulomb friction in the two directions is no separate term: fc⁺ and fc⁻ are fc and `off`
/// while the joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLaw {
    /// `fvq` q̇·|q̇|: nonlinear viscous friction, such as that of grease which warms in the gap.
    Quadratic,
    /// `fvc` q̇³.
    Cubic,
    /// `fva` |q̇|: viscous friction that differs by direction, fv ± fva.
    Asymmetric,
    /// `fcl` |g(q)| sign(q̇): Coulomb friction that grows with the load g on the gear, the torque
    /// that the drive holds where the arm rests at q (after Bittencourt, Wernholt, Sander-Tavallaey
    /// and Brogårdh 2010).
    Load,
    /// `fs` exp(−(q̇/vs)²) sign(q̇): friction that falls as motion begins (Bo and Pavelescu 1982, δ
    /// = 2).
    Stribeck {
        /// vs \[rad/s or m/s\].
        speed_rad_s: f64,
    },
    /// `fh` z: friction with hysteresis at reversals, a spring that slips (Maxwell slip, as in
    /// Al-Bender, Lampaert and Swevers, *The generalized Maxwell-slip model*, 2005). z goes from −1
    /// to 1 over the presliding distance, and stays there until the joint reverses: see
    /// [`Hysteresis`](super::Hysteresis).
    Hysteresis {
        /// Presliding distance: the travel after a reversal over which z changes \[rad or m\].
        way_rad: f64,
    },
}

impl FrictionLaw {
    /// Returns the kind of its coefficient.
    pub fn kind(self) -> ParameterKind {
        match self {
            Self::Quadratic => ParameterKind::FvQuadratic,
            Self::Cubic => ParameterKind::FvCubic,
            Self::Asymmetric => ParameterKind::FvAsymmetric,
            Self::Load => ParameterKind::FcLoad,
            Self::Stribeck { .. } => ParameterKind::Fs,
            Self::Hysteresis { .. } => ParameterKind::Fh,
        }
    }

    /// Returns the torque per unit of the coefficient at a speed. For load-dependent terms it is
    /// also per unit of load. For terms with hysteresis it is the value after a long motion in one
    /// direction.
    #[inline(always)]
    pub fn value<T: Scalar>(self, speed: T, sign: SignModel) -> T {
        match self {
            Self::Quadratic => speed * smooth_magnitude(speed),
            Self::Cubic => speed * speed * speed,
            Self::Asymmetric => smooth_magnitude(speed),
            Self::Load | Self::Hysteresis { .. } => sign.value(speed),
            Self::Stribeck { speed_rad_s } => stribeck_bell(speed, speed_rad_s) * sign.value(speed),
        }
    }

    /// Returns the derivative of the value with respect to the speed; 0 at jumps.
    pub(crate) fn slope(self, speed: f64, sign: SignModel) -> f64 {
        match self {
            Self::Quadratic => 2.0 * speed.abs(),
            Self::Cubic => 3.0 * speed * speed,
            Self::Asymmetric => Scalar::sign(speed),
            Self::Load | Self::Hysteresis { .. } => sign.slope(sign.value(speed)),
            Self::Stribeck { speed_rad_s } => {
                let (bell, value) = (stribeck_bell(speed, speed_rad_s), sign.value(speed));
                if bell <= 0.0 {
                    return 0.0;
                }
                let falls = -2.0 * (speed / speed_rad_s) / speed_rad_s * bell;
                falls * value + bell * sign.slope(value)
            }
        }
    }
}

fn smooth_magnitude<T: Scalar>(speed: T) -> T {
    speed * speed.sign()
}

/// Returns exp(−(v/vs)²), computed as (1 − t)/(1 + t) with t = tanh(½ (v/vs)²).
#[inline(always)]
fn stribeck_bell<T: Scalar>(speed: T, width: f64) -> T {
    let x = speed / T::constant(width);
    let t = (T::constant(0.5) * x * x).tanh();
    (T::constant(1.0) - t) / (T::constant(1.0) + t)
}

/// The sign model as written in a file.
#[derive(Serialize, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a sign model such as { model = \"tanh\", width_rad_s = 0.05 }"
)]
struct RawSignModel {
    model: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    threshold_rad_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    width_rad_s: Option<f64>,
}

impl From<SignModel> for RawSignModel {
    fn from(model: SignModel) -> Self {
        let (model, threshold_rad_s, width_rad_s) = match model {
            SignModel::Sign => ("sign", None, None),
            SignModel::DeadBand { threshold_rad_s } => ("dead-band", Some(threshold_rad_s), None),
            SignModel::Tanh { width_rad_s } => ("tanh", None, Some(width_rad_s)),
        };
        Self { model: model.to_owned(), threshold_rad_s, width_rad_s }
    }
}

fn check_positive(key: &str, value: f64, what: &str) -> Result<f64, String> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(format!("`{key}` is {value}; give a positive {what}"))
    }
}

impl TryFrom<RawSignModel> for SignModel {
    type Error = String;

    fn try_from(raw: RawSignModel) -> Result<Self, String> {
        match (raw.model.as_str(), raw.threshold_rad_s, raw.width_rad_s) {
            ("sign", None, None) => Ok(Self::Sign),
            ("dead-band", Some(threshold), None) => Ok(Self::DeadBand {
                threshold_rad_s: check_positive("threshold_rad_s", threshold, "speed in rad/s")?,
            }),
            ("tanh", None, Some(width)) => Ok(Self::Tanh {
                width_rad_s: check_positive("width_rad_s", width, "speed in rad/s")?,
            }),
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

/// Friction of one joint in a file; omitted keys have the values of all joints.
#[derive(Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "friction of a joint such as { quadratic = true, stribeck_rad_s = 0.1 }"
)]
pub(super) struct RawJointFriction {
    /// The law for the sign of the speed, of this joint.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) sign: Option<SignModel>,
    /// A term `fvq` × speed × |speed|.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) quadratic: Option<bool>,
    /// A term `fvc` × speed³.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cubic: Option<bool>,
    /// A term `fva` × |speed|: viscous friction that differs by direction.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) asymmetric: Option<bool>,
    /// A term `fcl` × |load| × sign: Coulomb friction proportional to the static load torque of the
    /// drive.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) load: Option<bool>,
    /// A term `fh` × z, which lags \[rad\]: after a reversal z goes from −1 to 1 over this way, and
    /// stays there (Maxwell slip); less than the joint's range. For a prismatic joint it is in m.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) hysteresis_rad: Option<f64>,
    /// A term `fs` × exp(−(speed/vs)²) × sign, which falls as motion begins \[rad/s\]; this is vs.
    /// For a prismatic joint it is in m/s.
    ///
    /// If left out: that of `[friction]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) stribeck_rad_s: Option<f64>,
}

impl RawJointFriction {
    /// Returns the same with omitted keys taken from `all`.
    pub(super) fn with_defaults(self, all: &Self) -> Self {
        Self {
            sign: self.sign.or(all.sign),
            quadratic: self.quadratic.or(all.quadratic),
            cubic: self.cubic.or(all.cubic),
            asymmetric: self.asymmetric.or(all.asymmetric),
            load: self.load.or(all.load),
            stribeck_rad_s: self.stribeck_rad_s.or(all.stribeck_rad_s),
            hysteresis_rad: self.hysteresis_rad.or(all.hysteresis_rad),
        }
    }
}

impl TryFrom<RawJointFriction> for JointFriction {
    type Error = String;

    fn try_from(raw: RawJointFriction) -> Result<Self, String> {
        let stribeck = raw.stribeck_rad_s.map(|speed_rad_s| {
            let speed_rad_s = check_positive("stribeck_rad_s", speed_rad_s, "speed in rad/s")?;
            Ok::<_, String>(FrictionLaw::Stribeck { speed_rad_s })
        });
        let hysteresis = raw.hysteresis_rad.map(|way_rad| {
            let way_rad = check_positive("hysteresis_rad", way_rad, "way in rad")?;
            Ok::<_, String>(FrictionLaw::Hysteresis { way_rad })
        });
        let law = |configured: Option<bool>, law| configured.unwrap_or(false).then_some(law);
        let laws = [
            law(raw.quadratic, FrictionLaw::Quadratic),
            law(raw.cubic, FrictionLaw::Cubic),
            law(raw.asymmetric, FrictionLaw::Asymmetric),
            law(raw.load, FrictionLaw::Load),
            stribeck.transpose()?,
            hysteresis.transpose()?,
        ];
        // Without Coulomb friction no term reads the sign model.
        let sign = raw.sign.unwrap_or(SignModel::Sign);
        Ok(Self { sign, laws: laws.into_iter().flatten().collect() })
    }
}

impl From<JointFriction> for RawJointFriction {
    fn from(friction: JointFriction) -> Self {
        let mut raw = Self { sign: Some(friction.sign), ..Self::default() };
        for law in friction.laws {
            match law {
                FrictionLaw::Quadratic => raw.quadratic = Some(true),
                FrictionLaw::Cubic => raw.cubic = Some(true),
                FrictionLaw::Asymmetric => raw.asymmetric = Some(true),
                FrictionLaw::Load => raw.load = Some(true),
                FrictionLaw::Stribeck { speed_rad_s } => raw.stribeck_rad_s = Some(speed_rad_s),
                FrictionLaw::Hysteresis { way_rad } => raw.hysteresis_rad = Some(way_rad),
            }
        }
        raw
    }
}

impl fmt::Display for SignModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sign => write!(f, "{{ model = \"sign\" }}"),
            Self::DeadBand { threshold_rad_s } => {
                write!(f, "{{ model = \"dead-band\", threshold_rad_s = {threshold_rad_s:?} }}")
            }
            Self::Tanh { width_rad_s } => {
                write!(f, "{{ model = \"tanh\", width_rad_s = {width_rad_s:?} }}")
            }
        }
    }
}

impl fmt::Display for FrictionLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Quadratic => write!(f, "quadratic = true"),
            Self::Cubic => write!(f, "cubic = true"),
            Self::Asymmetric => write!(f, "asymmetric = true"),
            Self::Load => write!(f, "load = true"),
            Self::Stribeck { speed_rad_s } => write!(f, "stribeck_rad_s = {speed_rad_s:?}"),
            Self::Hysteresis { way_rad } => write!(f, "hysteresis_rad = {way_rad:?}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGN: SignModel = SignModel::Tanh { width_rad_s: 0.1 };
    const LAWS: [FrictionLaw; 6] = [
        FrictionLaw::Quadratic,
        FrictionLaw::Cubic,
        FrictionLaw::Asymmetric,
        FrictionLaw::Load,
        FrictionLaw::Stribeck { speed_rad_s: 0.3 },
        FrictionLaw::Hysteresis { way_rad: 0.004 },
    ];

    #[test]
    fn laws_have_their_values_and_slopes() {
        let formulas: [fn(f64) -> f64; 6] = [
            |v| v * v.abs(),
            |v| v.powi(3),
            f64::abs,
            |v| (v / 0.1).tanh(),
            |v| (-(v / 0.3).powi(2)).exp() * (v / 0.1).tanh(),
            |v| (v / 0.1).tanh(),
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
