//! Drive units to SI, with the provenance of every gain.
//!
//! A gain that is wrong by a factor gives parameters that are wrong by that factor and fit
//! perfectly, so nothing here has a default: the sign, the zero, what a rated current is and where
//! the number comes from are all written in the cell file, and the unit that a gain expects is
//! checked against the unit in the DBC file.

use std::f64::consts::{SQRT_2, TAU};

use didim_core::MAX_JOINTS;
use serde::{Deserialize, Serialize};

use crate::layout::{CompiledLayout, Quantity, SignalFormat};

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
    Along,
    /// Against it.
    Against,
}

impl Sign {
    fn factor(self) -> f64 {
        match self {
            Self::Along => 1.0,
            Self::Against => -1.0,
        }
    }
}

impl TryFrom<i64> for Sign {
    type Error = &'static str;

    fn try_from(value: i64) -> Result<Self, Self::Error> {
        match value {
            1 => Ok(Self::Along),
            -1 => Ok(Self::Against),
            _ => Err("a sign is 1 or -1"),
        }
    }
}

impl From<Sign> for i64 {
    fn from(sign: Sign) -> Self {
        match sign {
            Sign::Along => 1,
            Sign::Against => -1,
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

/// Why gains were refused. Axes count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitsError {
    /// Not one drive per axis.
    #[error("`drives`: {found} for {axes} axes; give one per axis, in their order")]
    Drives {
        /// Axes of the layout.
        axes: usize,
        /// Drives given.
        found: usize,
    },
    /// A number that no drive has.
    #[error("drive {axis}: `{key}` is {value}; it has to be {expected}")]
    Number {
        /// The axis.
        axis: usize,
        /// The key.
        key: &'static str,
        /// What it says.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// The DBC file has the signal in another unit than the gain expects.
    #[error(
        "drive {axis}: the gain expects {expected}, and `{signal}` of the DBC file is in \"{unit}\""
    )]
    WrongUnit {
        /// The axis.
        axis: usize,
        /// `Message.Signal`.
        signal: String,
        /// The unit there.
        unit: String,
        /// The units that would match.
        expected: String,
    },
    /// A signal that does not wrap was said to.
    #[error("drive {axis}: `wraps = \"modulo\"`, and `{signal}` is not an integer")]
    NoModulus {
        /// The axis.
        axis: usize,
        /// `Message.Signal`.
        signal: String,
    },
}

/// The spellings of a unit in DBC files, the first of them ours.
const COUNT: &[&str] = &["count", "counts", "inc", "increments"];
const RAD: &[&str] = &["rad"];
const PER_MILLE: &[&str] = &["per mille", "permille", "‰", "0.1 %", "0.1%"];
const NM: &[&str] = &["Nm", "N·m", "N.m", "N*m"];

/// What a positive gain may be.
const POSITIVE: &str = "finite and greater than 0";

/// The gains of one axis, checked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct AxisScale {
    rad_per_unit: f64,
    zero: f64,
    modulo: bool,
    position: Range,
    reference: Range,
    nm_per_unit: f64,
}

/// The range of an integer, in the unit of the DBC file; infinite for a floating-point signal.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    length: f64,
    middle: f64,
}

impl Default for Range {
    fn default() -> Self {
        Self { length: f64::INFINITY, middle: 0.0 }
    }
}

impl Range {
    fn of(signal: &SignalFormat) -> Self {
        match (signal.field.modulus(), signal.field.middle()) {
            (Some(length), Some(middle)) => Self { length, middle },
            _ => Self::default(),
        }
    }

    /// `value` moved by whole ranges to within half a range of `middle`.
    fn around(self, middle: f64, value: f64) -> f64 {
        if self.length.is_finite() {
            value - self.length * ((value - middle) / self.length).round()
        } else {
            value
        }
    }
}

/// Drive units to SI and back, for every axis of a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct Scales {
    axes: [AxisScale; MAX_JOINTS],
}

impl Scales {
    /// Checks the gains against the units of the layout.
    ///
    /// # Errors
    /// [`UnitsError`] names the drive and what does not fit.
    pub fn new(drives: &[DriveSpec], layout: &CompiledLayout) -> Result<Self, UnitsError> {
        if drives.len() != layout.axes() {
            return Err(UnitsError::Drives { axes: layout.axes(), found: drives.len() });
        }
        let mut axes = [AxisScale::default(); MAX_JOINTS];
        for ((axis, drive), scale) in drives.iter().enumerate().zip(&mut axes) {
            *scale = axis_scale(axis, drive, layout)?;
        }
        Ok(Self { axes })
    }

    fn axis(&self, axis: usize) -> AxisScale {
        self.axes.get(axis).copied().unwrap_or_default()
    }

    /// The motor angle of a measured position \[rad\]. Axes count from 0.
    pub fn position_rad(&self, axis: usize, value: f64) -> f64 {
        let scale = self.axis(axis);
        scale.angle(scale.position, value)
    }

    /// The motor angle of a reference position \[rad\].
    pub fn reference_rad(&self, axis: usize, value: f64) -> f64 {
        let scale = self.axis(axis);
        scale.angle(scale.reference, value)
    }

    /// The motor torque \[N·m\].
    pub fn torque_nm(&self, axis: usize, value: f64) -> f64 {
        self.axis(axis).nm_per_unit * value
    }

    /// Whether an axis can have moved from one angle to another between two samples: a step of half
    /// the integer's range is a wrap, not a motion.
    pub fn is_continuous(&self, axis: usize, from_rad: f64, to_rad: f64) -> bool {
        let scale = self.axis(axis);
        let half = 0.5 * scale.position.length.min(scale.reference.length);
        (to_rad - from_rad).abs() < half * scale.rad_per_unit.abs()
    }

    /// The position that a drive reports at a motor angle \[unit of the DBC file\]; for the
    /// simulated robot and for tests.
    pub fn position_value(&self, axis: usize, angle_rad: f64) -> f64 {
        let scale = self.axis(axis);
        scale.value(scale.position, angle_rad)
    }

    /// The reference that a controller sends for a motor angle \[unit of the DBC file\].
    pub fn reference_value(&self, axis: usize, angle_rad: f64) -> f64 {
        let scale = self.axis(axis);
        scale.value(scale.reference, angle_rad)
    }

    /// The torque that a drive reports \[unit of the DBC file\].
    pub fn torque_value(&self, axis: usize, torque_nm: f64) -> f64 {
        torque_nm / self.axis(axis).nm_per_unit
    }
}

impl AxisScale {
    fn angle(self, range: Range, value: f64) -> f64 {
        let value = if self.modulo { range.around(self.zero, value) } else { value };
        self.rad_per_unit * (value - self.zero)
    }

    fn value(self, range: Range, angle_rad: f64) -> f64 {
        let value = angle_rad / self.rad_per_unit + self.zero;
        if self.modulo { range.around(range.middle, value) } else { value }
    }
}

fn axis_scale(
    axis: usize,
    drive: &DriveSpec,
    layout: &CompiledLayout,
) -> Result<AxisScale, UnitsError> {
    let (torque, position) = (&drive.torque, &drive.position);
    let (rad_per_unit, units) = rad_per_unit(axis, position.scale)?;
    let mut scale = AxisScale {
        rad_per_unit: position.sign.factor() * rad_per_unit,
        zero: number(axis, "position.zero", position.zero, f64::is_finite, "finite")?,
        modulo: position.wraps == Wraps::Modulo,
        ..AxisScale::default()
    };
    for (quantity, range) in
        [(Quantity::Position, &mut scale.position), (Quantity::Reference, &mut scale.reference)]
    {
        // A layout may be without a reference; the compiler has made sure of the position.
        let Some(signal) = layout.signal(quantity, axis) else { continue };
        check_unit(axis, signal, units)?;
        *range = Range::of(signal);
        if scale.modulo && !range.length.is_finite() {
            return Err(UnitsError::NoModulus { axis: axis + 1, signal: signal.name.clone() });
        }
    }
    let (nm_per_unit, units) = nm_per_unit(axis, torque.scale)?;
    scale.nm_per_unit = torque.sign.factor() * nm_per_unit;
    if let Some(signal) = layout.signal(Quantity::Torque, axis) {
        check_unit(axis, signal, units)?;
    }
    Ok(scale)
}

type Units = &'static [&'static str];

fn rad_per_unit(axis: usize, scale: PositionScale) -> Result<(f64, Units), UnitsError> {
    match scale {
        PositionScale::CountsPerRevolution(counts) => {
            let key = "position.scale.counts_per_revolution";
            Ok((TAU / positive(axis, key, counts)?, COUNT))
        }
        PositionScale::RadPerCount(angle) => {
            Ok((positive(axis, "position.scale.rad_per_count", angle)?, COUNT))
        }
        PositionScale::Rad => Ok((1.0, RAD)),
    }
}

fn nm_per_unit(axis: usize, scale: TorqueScale) -> Result<(f64, Units), UnitsError> {
    match scale {
        TorqueScale::PerMilleOfRatedTorque { rated_torque_nm } => {
            let rated = positive(axis, "torque.scale.rated_torque_nm", rated_torque_nm)?;
            Ok((1e-3 * rated, PER_MILLE))
        }
        TorqueScale::PerMilleOfRatedCurrent {
            rated_current_a,
            current_is,
            torque_constant_nm_per_a,
            torque_constant_is,
        } => {
            let current = positive(axis, "torque.scale.rated_current_a", rated_current_a)?;
            let constant =
                positive(axis, "torque.scale.torque_constant_nm_per_a", torque_constant_nm_per_a)?;
            // The current as the torque constant counts it: amplitude = √2 · effective value.
            let current = match (current_is, torque_constant_is) {
                (CurrentValue::Rms, CurrentValue::Peak) => current * SQRT_2,
                (CurrentValue::Peak, CurrentValue::Rms) => current / SQRT_2,
                (CurrentValue::Rms, CurrentValue::Rms)
                | (CurrentValue::Peak, CurrentValue::Peak) => current,
            };
            Ok((1e-3 * current * constant, PER_MILLE))
        }
        TorqueScale::NmPerCount(torque) => {
            Ok((positive(axis, "torque.scale.nm_per_count", torque)?, COUNT))
        }
        TorqueScale::Nm => Ok((1.0, NM)),
    }
}

fn positive(axis: usize, key: &'static str, value: f64) -> Result<f64, UnitsError> {
    number(axis, key, value, |value| value.is_finite() && value > 0.0, POSITIVE)
}

fn number(
    axis: usize,
    key: &'static str,
    value: f64,
    is_good: impl Fn(f64) -> bool,
    expected: &'static str,
) -> Result<f64, UnitsError> {
    if is_good(value) {
        Ok(value)
    } else {
        Err(UnitsError::Number { axis: axis + 1, key, value, expected })
    }
}

fn check_unit(axis: usize, signal: &SignalFormat, units: Units) -> Result<(), UnitsError> {
    if units.contains(&signal.unit.as_str()) {
        return Ok(());
    }
    Err(UnitsError::WrongUnit {
        axis: axis + 1,
        signal: signal.name.clone(),
        unit: signal.unit.clone(),
        expected: units.iter().map(|unit| format!("\"{unit}\"")).collect::<Vec<_>>().join(" or "),
    })
}
