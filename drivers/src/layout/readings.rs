//! Signals of additional readings of the drives, in the units that samples use.

use didim_dynamics::Reading;

use super::dbc::SignalFormat;
use super::error::LayoutError;
use super::field::Encoding;
use super::plan::{MessagePlan, Quantity};
use super::spec::{LayoutSpec, ReadingSpec, SignalNames};
use crate::frame::Frame;

/// Returns the readings that a layout specifies, each with its keys, its quantity and its
/// specification.
pub(super) fn reading_specs(
    spec: &LayoutSpec,
) -> impl Iterator<Item = (Reading, [&'static str; 3], &ReadingSpec)> {
    let readings = [
        (Reading::Temperature, &spec.temperature),
        (Reading::SupplyVoltage, &spec.supply_voltage),
        (Reading::Mode, &spec.mode),
    ];
    readings
        .into_iter()
        .filter_map(|(reading, spec)| Some((reading, reading_keys(reading), spec.as_ref()?)))
}

/// Returns the signals of the control law in the commands, each with its reading, key and names.
pub(super) fn law_signals(
    spec: &LayoutSpec,
) -> impl Iterator<Item = (Reading, &'static str, &SignalNames)> {
    let signals = spec.law.iter().flat_map(|law| {
        [
            (Reading::Stiffness, &law.stiffness),
            (Reading::Damping, &law.damping),
            (Reading::SpeedTarget, &law.speed),
            (Reading::TorqueTarget, &law.torque),
        ]
    });
    signals.map(|(reading, names)| (reading, reading_keys(reading)[0], names))
}

/// Returns the keys of the signal, the object and the unit of a reading.
fn reading_keys(reading: Reading) -> [&'static str; 3] {
    match reading {
        Reading::Temperature => ["temperature.signal", "temperature.object", "temperature.unit"],
        Reading::SupplyVoltage => {
            ["supply_voltage.signal", "supply_voltage.object", "supply_voltage.unit"]
        }
        Reading::Mode => ["mode.signal", "mode.object", "mode.unit"],
        // Signals of a law come only from a DBC file.
        Reading::Stiffness => ["law.stiffness"; 3],
        Reading::Damping => ["law.damping"; 3],
        Reading::SpeedTarget => ["law.speed"; 3],
        Reading::TorqueTarget => ["law.torque"; 3],
    }
}

/// Returns the accepted unit names, each with its size in the unit of the reading.
fn units(reading: Reading) -> &'static [(&'static str, f64)] {
    match reading {
        Reading::Temperature => {
            &[("degC", 1.0), ("°C", 1.0), ("C", 1.0), ("0.1 degC", 0.1), ("0.1 °C", 0.1)]
        }
        Reading::SupplyVoltage => &[("V", 1.0), ("mV", 1e-3), ("0.1 V", 0.1), ("0.01 V", 0.01)],
        // A mode is a number without a unit, regardless of the unit in the file.
        Reading::Mode => &[],
        Reading::Stiffness => &[("Nm/rad", 1.0), ("N.m/rad", 1.0), ("N·m/rad", 1.0)],
        Reading::Damping => {
            &[("Nms/rad", 1.0), ("Nm.s/rad", 1.0), ("N.m.s/rad", 1.0), ("N·m·s/rad", 1.0)]
        }
        Reading::SpeedTarget => &[("rad/s", 1.0)],
        Reading::TorqueTarget => &[("Nm", 1.0), ("N.m", 1.0), ("N·m", 1.0)],
    }
}

/// Converts the signal of a reading to the unit that samples use. Other signals are not changed.
///
/// # Errors
/// Returns a description if the unit does not fit the reading, or if a mode is not an integer.
pub(super) fn in_own_unit(
    quantity: Quantity,
    signal: SignalFormat,
) -> Result<SignalFormat, LayoutError> {
    let Quantity::Reading(reading) = quantity else { return Ok(signal) };
    let wrong = |reason| LayoutError::Signal { signal: signal.name.clone(), line: None, reason };
    if reading == Reading::Mode {
        let integer = matches!(signal.field.encoding(), Encoding::Unsigned | Encoding::Signed);
        if !integer || signal.field.scale() != (1.0, 0.0) || signal.field.width() > 16 {
            let reason = "a mode is an integer of at most 16 bits with factor 1 and offset 0";
            return Err(wrong(reason.to_owned()));
        }
        return Ok(signal);
    }
    let units = units(reading);
    let Some((_, factor)) = units.iter().find(|(unit, _)| *unit == signal.unit) else {
        let names: Vec<String> = units.iter().map(|(unit, _)| format!("\"{unit}\"")).collect();
        return Err(wrong(format!(
            "a {quantity} in \"{}\"; it has to be {}",
            signal.unit,
            names.join(" or ")
        )));
    };
    Ok(SignalFormat {
        field: signal.field.in_unit(*factor),
        unit: reading.unit().to_owned(),
        range: signal.range.map(|(from, to)| (factor * from, factor * to)),
        ..signal
    })
}

impl MessagePlan {
    /// Adds the readings of a frame to the earlier readings. A reading out of its range is dropped.
    pub(crate) fn read_readings(&self, frame: &Frame, readings: &mut didim_dynamics::Readings) {
        for extraction in &self.extractions {
            if let Quantity::Reading(reading) = extraction.quantity
                && let Some(value) = extraction.value(frame.data())
            {
                readings.set(reading, extraction.axis, value);
            }
        }
    }
}
