//! Gain settings of the drives in a cell file.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// One entry of `[[bus.drives]]` in a cell file: the gains of one drive, in the order of the axes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveSpec {
    /// Gain of the position and of the reference.
    pub position: PositionGain,
    /// Gain of the torque.
    pub torque: TorqueGain,
}

/// `motor angle = sign × factor × scale × (value − zero)`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PositionGain {
    /// Size of one unit of the value: one of the forms below.
    pub scale: PositionScale,
    /// 1, or −1 where the drive counts against the direction of the robot file.
    pub sign: Sign,
    /// Correction of the scale; above 0.
    ///
    /// If left out: 1.
    #[serde(default = "no_correction", skip_serializing_if = "is_no_correction")]
    pub factor: f64,
    /// The value, in the unit of the DBC file or of the object, at which the motor angle of the
    /// robot file is 0 \[unit of the signal\].
    pub zero: f64,
    /// Treatment of a wrap of the integer. `"refuse"`: the axis never reaches the end of the range,
    /// and a jump of half of it is out of range. `"modulo"`: the difference from `zero` is taken
    /// modulo the range, to ± half of it, for axes that travel less than the range.
    pub wraps: WrapTreatment,
    /// Source of the numbers: a data sheet with its page, an object read from the drive, a
    /// measurement. Never empty.
    pub provenance: Provenance,
}

/// Size of one unit of a position.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PositionScale {
    /// Counts to one revolution of the motor (608Fh).
    CountsPerRevolution(f64),
    /// The angle of one count \[rad\].
    RadPerCount(f64),
    /// The factor of the DBC file already gives rad.
    Rad,
    /// The factor of the DBC file gives degrees.
    Deg,
    /// The factor of the DBC file gives turns of the motor.
    Rev,
}

/// Treatment of a wrap of the integer of a position.
///
/// The travel of a robot's axis is limited. If it is shorter than the range of the integer, the
/// angle is the difference from `zero` modulo that range. The number of earlier wraps has no
/// effect. No state has to be stored, so the angle is also correct after a restart. If the travel
/// of an axis is longer than the range, the bits cannot identify its angle at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WrapTreatment {
    /// The axis never reaches the end of the range: a jump of half the range is out of range.
    Refuse,
    /// The difference from `zero` is taken modulo the range, to ± half of it.
    Modulo,
}

/// `motor torque = sign × factor × scale × value`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TorqueGain {
    /// Size of one unit of the value: one of the forms below.
    pub scale: TorqueScale,
    /// 1, or −1 if the drive's torque is against the direction of the robot file.
    pub sign: Sign,
    /// Correction of the scale; above 0.
    ///
    /// If left out: 1.
    #[serde(default = "no_correction", skip_serializing_if = "is_no_correction")]
    pub factor: f64,
    /// Source of the numbers: a data sheet with its page, an object read from the drive, a
    /// measurement. Never empty.
    pub provenance: Provenance,
}

/// Returns the factor of a scale that needs no correction.
fn no_correction() -> f64 {
    1.0
}

/// Returns true if a scale needs no correction.
fn is_no_correction(factor: &f64) -> bool {
    factor.total_cmp(&1.0).is_eq()
}

/// Size of one unit of a torque.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TorqueScale {
    /// The value is in per mille of the rated torque (6074h and 6077h of 6076h).
    PerMilleOfRatedTorque {
        /// Rated torque of the motor (6076h) \[N·m\].
        rated_torque_nm: f64,
    },
    /// The value is in per mille of the rated current (6078h of 6075h), and the torque constant
    /// makes a torque of it.
    PerMilleOfRatedCurrent {
        /// Rated current of the motor (6075h) \[A\].
        rated_current_a: f64,
        /// Kind of that current: effective value or amplitude.
        current_is: CurrentValue,
        /// Torque constant of the motor \[N·m/A\].
        torque_constant_nm_per_a: f64,
        /// Per ampere of which value of the current.
        torque_constant_is: CurrentValue,
    },
    /// The torque of one count \[N·m\].
    NmPerCount(f64),
    /// The factor of the DBC file gives a current in A, of which an ampere is worth so much
    /// \[N·m/A\]: torque constant, gear and what the firmware of the drive makes of a current, in
    /// one number.
    NmPerA(f64),
    /// The factor of the DBC file already gives N·m.
    Nm,
}

/// Kind of value of a sinusoidal phase current: vendors disagree, and the difference is a factor of
/// √2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CurrentValue {
    /// Effective value.
    Rms,
    /// Amplitude, √2 times the effective value.
    Peak,
}

/// A direction: 1 or −1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "i64", into = "i64")]
pub enum Sign {
    /// The direction of the robot file.
    Positive,
    /// Against the direction of the robot file.
    Negative,
}

impl JsonSchema for Sign {
    fn schema_name() -> Cow<'static, str> {
        "Sign".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "enum": [1, -1] })
    }
}

impl Sign {
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}

impl TryFrom<i64> for Sign {
    type Error = &'static str;

    fn try_from(value: i64) -> Result<Self, Self::Error> {
        match value {
            1 => Ok(Self::Positive),
            -1 => Ok(Self::Negative),
            _ => Err("a sign is 1 or -1"),
        }
    }
}

impl From<Sign> for i64 {
    fn from(sign: Sign) -> Self {
        match sign {
            Sign::Positive => 1,
            Sign::Negative => -1,
        }
    }
}

/// Provenance of a number: a data sheet with its page, an object read from the drive, a
/// measurement. Never empty.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(extend("minLength" = 1))]
pub struct Provenance(String);

impl Provenance {
    /// Returns the text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for Provenance {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        if text.trim().is_empty() {
            return Err(
                "say where the number comes from: a data sheet, an object of the drive, a \
                        measurement",
            );
        }
        Ok(Self(text))
    }
}

impl From<Provenance> for String {
    fn from(provenance: Provenance) -> Self {
        provenance.0
    }
}
