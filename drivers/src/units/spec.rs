//! What a cell file says about the gains of its drives.

use serde::{Deserialize, Serialize};

/// One entry of `[[bus.drives]]` in a cell file: the gains of one drive, in the order of the axes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DriveSpec {
    /// Position and reference position.
    pub position: PositionGain,
    /// Torque.
    pub torque: TorqueGain,
}

/// `motor angle = sign × scale × (value − zero)`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PositionGain {
    /// What one unit of the DBC file is.
    pub scale: PositionScale,
    /// 1, or −1 where the drive counts against the direction of the robot file.
    pub sign: Sign,
    /// The value, in the unit of the DBC file, at which the motor angle of the robot file is 0.
    pub zero: f64,
    /// What to do where the integer starts again.
    pub wraps: Wraps,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// What one unit of a position is.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionScale {
    /// Counts per revolution of the motor (608Fh).
    CountsPerRevolution(f64),
    /// The angle of one count \[rad\].
    RadPerCount(f64),
    /// The DBC file's factor already gives rad.
    Rad,
    /// The DBC file's factor gives degrees.
    Deg,
}

/// What to do where the integer of a position starts again.
///
/// The travel of a robot's axis is limited. Where it is shorter than the range of the integer, the
/// difference from `zero` modulo that range is the angle, whatever the number of times the counter
/// has wrapped before: nothing has to be remembered, so the angle is right after a restart too. An
/// axis whose travel is longer than the range cannot be told from the bits at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wraps {
    /// The axis never reaches the end of the range: a jump of half the range is out of range.
    Refuse,
    /// The difference from `zero` is taken modulo the range, to ± half of it.
    Modulo,
}

/// `motor torque = sign × scale × value`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueGain {
    /// What one unit of the DBC file is.
    pub scale: TorqueScale,
    /// 1, or −1 where the drive's torque is against the direction of the robot file.
    pub sign: Sign,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// What one unit of a torque is.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TorqueScale {
    /// Per mille of the rated torque (6074h and 6077h of 6076h).
    PerMilleOfRatedTorque {
        /// Rated torque of the motor (6076h) \[N·m\].
        rated_torque_nm: f64,
    },
    /// Per mille of the rated current (6078h of 6075h), by the torque constant.
    PerMilleOfRatedCurrent {
        /// Rated current of the motor (6075h) \[A\].
        rated_current_a: f64,
        /// Which value of the current that is.
        current_is: CurrentValue,
        /// Torque constant \[N·m/A\].
        torque_constant_nm_per_a: f64,
        /// Per ampere of which value.
        torque_constant_is: CurrentValue,
    },
    /// The torque of one count \[N·m\].
    NmPerCount(f64),
    /// The DBC file's factor gives a current in A, which is worth so much torque \[N·m/A\]: torque
    /// constant, gear and whatever the drive's firmware makes of a current, in one number.
    NmPerA(f64),
    /// The DBC file's factor already gives N·m.
    Nm,
}

/// Which value of a sinusoidal phase current: vendors disagree, and it is a factor of √2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
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

/// Where a number comes from: a data sheet with its page, an object read from the drive, a
/// measurement. Never empty.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "String", into = "String")]
pub struct Provenance(String);

impl Provenance {
    /// The text.
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
