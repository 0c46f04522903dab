//! Conversion of drive units to SI, with the provenance of every gain.
//!
//! If a gain is wrong by a factor, the identified parameters are wrong by the same factor and still
//! fit perfectly. So no gain has a default value. The cell file contains the sign, the zero, the
//! meaning of the rated current, and the provenance of each number. The unit that a gain expects is
//! checked against the unit in the DBC file.

mod error;
mod spec;

use didim_dynamics::robot::MotorIndex;
use std::f64::consts::{SQRT_2, TAU};

use didim_dynamics::MAX_JOINTS;

pub use error::UnitsError;
pub use spec::{
    CurrentValue, DriveSpec, PositionGain, PositionScale, Provenance, Sign, TorqueGain,
    TorqueScale, WrapTreatment,
};

use crate::layout::{CompiledLayout, Quantity, SignalFormat};

/// Accepted spellings of a unit in DBC files. The first spelling is the one that this program
/// writes.
const COUNT_SPELLINGS: &[&str] = &["count", "counts", "inc", "increments"];
const RAD_SPELLINGS: &[&str] = &["rad"];
const DEG_SPELLINGS: &[&str] = &["deg", "°", "degree", "degrees"];
const REV_SPELLINGS: &[&str] = &["rev", "revs", "turn", "turns"];
const AMPERE_SPELLINGS: &[&str] = &["A"];
const PER_MILLE_SPELLINGS: &[&str] = &["per mille", "permille", "‰", "0.1 %", "0.1%"];
const NM_SPELLINGS: &[&str] = &["Nm", "N·m", "N.m", "N*m"];

/// Allowed values of a positive gain.
const POSITIVE_GAIN: &str = "finite and greater than 0";

/// Checked gains of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct AxisScale {
    rad_per_unit: f64,
    zero: f64,
    is_modulo: bool,
    position: IntegerRange,
    reference: IntegerRange,
    /// Angle of one unit of a following error \[rad\]; `None` if the references are positions.
    following_rad: Option<f64>,
    nm_per_unit: f64,
}

/// Range of an integer signal, in the unit of the DBC file; infinite for a floating-point signal.
#[derive(Clone, Copy, Debug, PartialEq)]
struct IntegerRange {
    length: f64,
    middle: f64,
}

impl Default for IntegerRange {
    fn default() -> Self {
        Self { length: f64::INFINITY, middle: 0.0 }
    }
}

impl IntegerRange {
    fn from_signal(signal: &SignalFormat) -> Self {
        match (signal.field.modulus(), signal.field.range_middle()) {
            (Some(length), Some(middle)) => Self { length, middle },
            _ => Self::default(),
        }
    }

    /// Returns `value` shifted by a multiple of the range, to within half a range of `middle`.
    fn nearest_to(self, middle: f64, value: f64) -> f64 {
        if self.length.is_finite() {
            // A value half a range below the middle stays. A value half a range above the middle is
            // shifted.
            value - self.length * ((value - middle) / self.length + 0.5).floor()
        } else {
            value
        }
    }
}

/// Conversion of drive units to SI and back, for every axis of a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct Scales {
    axes: [AxisScale; MAX_JOINTS],
}

impl Scales {
    /// Checks the gains against the units of the layout.
    ///
    /// # Errors
    /// [`UnitsError`] names the drive and the mismatch.
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

    fn axis_scale_of(&self, axis: usize) -> AxisScale {
        self.axes.get(axis).copied().unwrap_or_default()
    }

    /// Returns the motor angle of a measured position \[rad\]. Axes count from 0.
    pub fn position_rad(&self, axis: usize, value: f64) -> f64 {
        let scale = self.axis_scale_of(axis);
        scale.to_angle(scale.position, value)
    }

    /// Returns the motor angle of a reference \[rad\]. If references are following errors, the
    /// value is added to the measured angle with its sign.
    pub fn reference_rad(&self, axis: usize, value: f64, position_rad: f64) -> f64 {
        let scale = self.axis_scale_of(axis);
        match scale.following_rad {
            Some(rad_per_unit) => position_rad + rad_per_unit * value,
            None => scale.to_angle(scale.reference, value),
        }
    }

    /// Returns the motor torque \[N·m\].
    pub fn torque_nm(&self, axis: usize, value: f64) -> f64 {
        self.axis_scale_of(axis).nm_per_unit * value
    }

    /// Returns true if an axis can have moved from one angle to another between two samples. A step
    /// of half the integer's range or more is a wrap and not a motion.
    pub fn is_continuous(&self, axis: usize, from_rad: f64, to_rad: f64) -> bool {
        let scale = self.axis_scale_of(axis);
        let half = 0.5 * scale.position.length.min(scale.reference.length);
        (to_rad - from_rad).abs() < half * scale.rad_per_unit.abs()
    }

    /// Returns the position that a drive reports at a motor angle \[unit of the DBC file\]. It
    /// serves the simulated robot and tests.
    pub fn position_value(&self, axis: usize, angle_rad: f64) -> f64 {
        let scale = self.axis_scale_of(axis);
        scale.scaled_value(scale.position, angle_rad)
    }

    /// Returns how far the position of a drive moves with a radian of its motor \[unit of the DBC
    /// file per rad\].
    pub fn position_per_rad(&self, axis: usize) -> f64 {
        1.0 / self.axis_scale_of(axis).rad_per_unit
    }

    /// Returns the reference that a controller sends for a motor angle \[unit of the DBC file\]. If
    /// references are following errors, returns the error that a drive reports at a measured angle.
    pub fn reference_value(&self, axis: usize, angle_rad: f64, position_rad: f64) -> f64 {
        let scale = self.axis_scale_of(axis);
        match scale.following_rad {
            Some(rad_per_unit) => (angle_rad - position_rad) / rad_per_unit,
            None => scale.scaled_value(scale.reference, angle_rad),
        }
    }

    /// Returns the torque that a drive reports \[unit of the DBC file\].
    pub fn torque_value(&self, axis: usize, torque_nm: f64) -> f64 {
        torque_nm / self.axis_scale_of(axis).nm_per_unit
    }
}

impl AxisScale {
    fn to_angle(self, range: IntegerRange, value: f64) -> f64 {
        let value = if self.is_modulo { range.nearest_to(self.zero, value) } else { value };
        self.rad_per_unit * (value - self.zero)
    }

    fn scaled_value(self, range: IntegerRange, angle_rad: f64) -> f64 {
        let value = angle_rad / self.rad_per_unit + self.zero;
        if self.is_modulo { range.nearest_to(range.middle, value) } else { value }
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
        rad_per_unit: position.sign.factor()
            * check_positive(axis, "position.factor", position.factor)?
            * rad_per_unit,
        zero: check_number(axis, "position.zero", position.zero, f64::is_finite, "finite")?,
        is_modulo: position.wraps == WrapTreatment::Modulo,
        ..AxisScale::default()
    };
    for quantity in [Quantity::Position, Quantity::Reference] {
        // A layout may have no reference; the compiler guarantees the position.
        let Some(signal) = layout.signal(quantity, axis) else { continue };
        check_unit(axis, signal, units)?;
        if let (Quantity::Reference, Some(error)) = (quantity, layout.following_error()) {
            // A following error is a difference, so it has no zero and does not wrap.
            scale.following_rad = Some(error.sign() * scale.rad_per_unit);
            continue;
        }
        let range = IntegerRange::from_signal(signal);
        if scale.is_modulo && !range.length.is_finite() {
            return Err(UnitsError::NoModulus {
                axis: MotorIndex::new(axis),
                signal: signal.name.clone(),
            });
        }
        match quantity {
            Quantity::Position => scale.position = range,
            _ => scale.reference = range,
        }
    }
    let (nm_per_unit, units) = nm_per_unit(axis, torque.scale)?;
    let factor = check_positive(axis, "torque.factor", torque.factor)?;
    scale.nm_per_unit = torque.sign.factor() * factor * nm_per_unit;
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
            Ok((TAU / check_positive(axis, key, counts)?, COUNT_SPELLINGS))
        }
        PositionScale::RadPerCount(angle) => {
            Ok((check_positive(axis, "position.scale.rad_per_count", angle)?, COUNT_SPELLINGS))
        }
        PositionScale::Rad => Ok((1.0, RAD_SPELLINGS)),
        PositionScale::Deg => Ok((1_f64.to_radians(), DEG_SPELLINGS)),
        PositionScale::Rev => Ok((TAU, REV_SPELLINGS)),
    }
}

fn nm_per_unit(axis: usize, scale: TorqueScale) -> Result<(f64, Units), UnitsError> {
    match scale {
        TorqueScale::PerMilleOfRatedTorque { rated_torque_nm } => {
            let rated = check_positive(axis, "torque.scale.rated_torque_nm", rated_torque_nm)?;
            Ok((1e-3 * rated, PER_MILLE_SPELLINGS))
        }
        TorqueScale::PerMilleOfRatedCurrent {
            rated_current_a,
            current_is,
            torque_constant_nm_per_a,
            torque_constant_is,
        } => {
            let current = check_positive(axis, "torque.scale.rated_current_a", rated_current_a)?;
            let constant = check_positive(
                axis,
                "torque.scale.torque_constant_nm_per_a",
                torque_constant_nm_per_a,
            )?;
            // Convert the current to the value that the torque constant uses: amplitude = √2 ·
            // effective value.
            let current = match (current_is, torque_constant_is) {
                (CurrentValue::Rms, CurrentValue::Peak) => current * SQRT_2,
                (CurrentValue::Peak, CurrentValue::Rms) => current / SQRT_2,
                (CurrentValue::Rms, CurrentValue::Rms)
                | (CurrentValue::Peak, CurrentValue::Peak) => current,
            };
            Ok((1e-3 * current * constant, PER_MILLE_SPELLINGS))
        }
        TorqueScale::NmPerCount(torque) => {
            Ok((check_positive(axis, "torque.scale.nm_per_count", torque)?, COUNT_SPELLINGS))
        }
        TorqueScale::NmPerA(torque) => {
            Ok((check_positive(axis, "torque.scale.nm_per_a", torque)?, AMPERE_SPELLINGS))
        }
        TorqueScale::Nm => Ok((1.0, NM_SPELLINGS)),
    }
}

fn check_positive(axis: usize, key: &'static str, value: f64) -> Result<f64, UnitsError> {
    check_number(axis, key, value, |value| value.is_finite() && value > 0.0, POSITIVE_GAIN)
}

fn check_number(
    axis: usize,
    key: &'static str,
    value: f64,
    is_good: impl Fn(f64) -> bool,
    expected: &'static str,
) -> Result<f64, UnitsError> {
    if is_good(value) {
        Ok(value)
    } else {
        Err(UnitsError::Number { axis: MotorIndex::new(axis), key, value, expected })
    }
}

fn check_unit(axis: usize, signal: &SignalFormat, units: Units) -> Result<(), UnitsError> {
    if units.contains(&signal.unit.as_str()) {
        return Ok(());
    }
    Err(UnitsError::WrongUnit {
        axis: MotorIndex::new(axis),
        signal: signal.name.clone(),
        unit: signal.unit.clone(),
        expected: units.iter().map(|unit| format!("\"{unit}\"")).collect::<Vec<_>>().join(" or "),
    })
}
