//! Torque gains of a cell's drives, from recordings without and with a known load.

use didim_dynamics::robot::JointIndex;
use std::ops::Range;

use didim_drivers::units::{DriveSpec, Provenance, Sign, TorqueGain, TorqueScale};
use didim_formats::{Measurement, Side};
use didim_identification::identification::{
    ArmParameter, DriveGain, ExperimentError, Gains, GainsError, KnownLoad, MahalanobisDistance,
    Scale, UncertainValue, find_gains,
};
use serde::Serialize;

use super::identify::join_measurements;
use crate::cell::Cell;
use crate::text::{significant_digits, to_uncertainty};

/// Maximum number of digits of a gain in the line of a cell file.
const MAX_DIGITS: usize = 6;

/// Error when no gains can be identified. The inner errors state the remedy.
#[derive(Debug, thiserror::Error)]
pub enum FindGainsError {
    /// A recording does not fit this robot as an experiment.
    #[error("the data do not fit this robot: {0}")]
    Experiment(#[from] ExperimentError),
    /// One recording has motor torques, and the other has joint torques.
    #[error(
        "one recording has torques of the motors and the other of the joints; give both as they \
        come from one source"
    )]
    Sides,
    /// The recordings do not identify the gains.
    #[error(transparent)]
    Gains(#[from] GainsError),
}

/// Torque gain of one drive: configured in the cell and found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundGain {
    /// Its joint.
    pub joint: JointIndex,
    /// Key of the gain in the cell file: `factor` if the drive reports the torque in N·m. `None` if
    /// the torque comes from a table.
    pub key: Option<&'static str>,
    /// Unit of the gain.
    pub unit: &'static str,
    /// Gain configured in the cell, without its sign. It is 1 if there is no key.
    #[serde(rename = "stated")]
    pub configured: f64,
    /// Identified gain, negative if its sign is opposite to the configured one. `None` if it is not
    /// identifiable; the configured gain then remains in use.
    pub found: Option<UncertainValue>,
    /// Gain identified by total least squares alone.
    pub total_least_squares: f64,
    /// Line for `[[bus.drives]]` of the cell file with the identified gain.
    pub cell_line: Option<String>,
}

/// Gains of the drives, and the arm's parameters with these gains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundGains {
    /// One entry per drive.
    pub gains: Vec<FoundGain>,
    /// Base parameters of the arm without load.
    pub parameters: Vec<ArmParameter>,
    /// Reference that sets the scale of gains and parameters: the mass of the load, or the
    /// configured gain of one drive.
    #[serde(flatten)]
    pub scale: Scale,
    /// Distance between the configured centre of mass of the load and the identified one. `None` if
    /// the recordings do not identify it.
    pub centre: Option<MahalanobisDistance>,
    /// ‖residuals‖ / ‖torque‖ of every drive.
    pub relative_error_per_joint: Vec<f64>,
}

/// Measurements, each with its range of counted samples.
type Counted<'a> = [(&'a Measurement, Range<usize>)];

/// Identifies the torque gains of a cell's drives from measurements without and with a load. Uses
/// the samples in each range. Without a load, the configured gain of one drive is taken as correct.
///
/// # Errors
/// [`FindGainsError`].
pub fn find_drive_gains(
    cell: &Cell,
    empty: &Counted<'_>,
    loaded: Option<(&Counted<'_>, KnownLoad)>,
) -> Result<FoundGains, FindGainsError> {
    let is_of_motors = |(measurement, _): &(&Measurement, _)| measurement.side == Side::Motor;
    let measurements = || empty.iter().chain(loaded.iter().flat_map(|(of, _)| of.iter()));
    let of_motors = measurements().all(is_of_motors);
    if !of_motors && measurements().any(is_of_motors) {
        return Err(FindGainsError::Sides);
    }
    let empty = join_measurements(cell, empty)?;
    let loaded = loaded.map(|(of, load)| Ok((join_measurements(cell, of)?, load)));
    let loaded = loaded.transpose().map_err(FindGainsError::Experiment)?;
    let transferred = loaded.as_ref().map(|(of, load)| (of, *load));
    let transmission = of_motors.then(|| cell.robot.transmission());
    let outcome =
        find_gains(&cell.robot, &cell.base, &empty, transferred, transmission, &cell.options)?;
    let Gains { gains, parameters, scale, centre, relative_error_per_joint } = outcome;
    let basis = match scale {
        Scale::Load(load) => format!("by a load of {} kg", load.mass_kg),
        Scale::Reference(joint) => format!(
            "without a load, from the configured gain of joint \
            {joint}"
        ),
    };
    let drives = cell.bus().map(|bus| bus.drives.as_slice()).unwrap_or_default();
    let gains = gains.iter().map(|gain| {
        let mut gain_found = FoundGain::new(gain, drives.get(gain.joint.position()), &basis);
        if scale == Scale::Reference(gain.joint) {
            // The reference gain stays as configured in the cell.
            gain_found.cell_line = None;
        }
        gain_found
    });
    let gains = gains.collect();
    Ok(FoundGains { gains, parameters, scale, centre, relative_error_per_joint })
}

impl FoundGain {
    fn new(gain: &DriveGain, drive: Option<&DriveSpec>, basis: &str) -> Self {
        let mut gain_of_cell = drive.map(|drive| drive.torque.clone());
        let (key, unit, value) = gain_of_cell
            .as_mut()
            .map(proportional_value)
            .map_or((None, "× stated", 1.0), |(key, unit, value)| (Some(key), unit, *value));
        let factor_found =
            gain.factor.map(|UncertainValue { value: factor, standard_deviation }| {
                UncertainValue {
                    value: value * factor,
                    standard_deviation: value * standard_deviation,
                }
            });
        let line = key.zip(drive).zip(factor_found);
        Self {
            joint: gain.joint,
            key,
            unit,
            configured: value,
            found: factor_found,
            total_least_squares: value * gain.total_least_squares,
            cell_line: line.and_then(|((_, drive), found)| line_of(drive, found, unit, basis)),
        }
    }
}

/// Returns the configured number that the torque is proportional to, with its key and unit. It is
/// the factor if the drive reports the torque in N·m.
fn proportional_value(gain: &mut TorqueGain) -> (&'static str, &'static str, &mut f64) {
    match &mut gain.scale {
        TorqueScale::PerMilleOfRatedTorque { rated_torque_nm } => {
            ("rated_torque_nm", "N·m", rated_torque_nm)
        }
        TorqueScale::PerMilleOfRatedCurrent { torque_constant_nm_per_a, .. } => {
            ("torque_constant_nm_per_a", "N·m/A", torque_constant_nm_per_a)
        }
        TorqueScale::NmPerCount(torque) => ("nm_per_count", "N·m/count", torque),
        TorqueScale::NmPerA(torque) => ("nm_per_a", "N·m/A", torque),
        TorqueScale::Nm => ("factor", "× stated", &mut gain.factor),
    }
}

/// Formats the drive's torque entry with the identified gain for a cell file.
fn line_of(drive: &DriveSpec, found: UncertainValue, unit: &str, basis: &str) -> Option<String> {
    let (value, deviation) = (found.value.abs(), found.standard_deviation);
    let text = to_uncertainty(value, deviation, MAX_DIGITS);
    let number: f64 = text.parse().ok()?;
    let mut gain = drive.torque.clone();
    *proportional_value(&mut gain).2 = number;
    let TorqueGain { scale, factor, .. } = gain;
    let sign = match drive.torque.sign {
        same if found.value > 0.0 => same,
        Sign::Positive => Sign::Negative,
        Sign::Negative => Sign::Positive,
    };
    let comment =
        format!("didim gains: {text} ± {} {unit}, {basis}", significant_digits(deviation, 2));
    let provenance = Provenance::try_from(comment).ok()?;
    let line = toml::Value::try_from(TorqueGain { scale, sign, factor, provenance }).ok()?;
    Some(format!("torque = {line}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_cell_has_the_found_gain_and_where_it_comes_from() {
        let drive: DriveSpec = toml::from_str(
            "position = { scale = 'rad', sign = 1, zero = 0.0, wraps = 'refuse', provenance = 'x' \
             }\n\
             torque = { scale = { per_mille_of_rated_current = { rated_current_a = 2.0, current_is \
             = 'rms', torque_constant_nm_per_a = 0.5, torque_constant_is = 'rms' } }, sign = 1, \
             provenance = 'x' }",
        )
        .unwrap();
        let basis = "by a load of 2.5 kg";
        let factor = Some(UncertainValue { value: -1.5, standard_deviation: 0.01 });
        let gain = DriveGain { joint: JointIndex::new(2), factor, total_least_squares: -1.49 };
        let gain_found = FoundGain::new(&gain, Some(&drive), basis);
        let torque: TorqueGain = toml::from_str::<toml::Table>(&gain_found.cell_line.unwrap())
            .unwrap()["torque"]
            .clone()
            .try_into()
            .unwrap();
        assert_eq!(torque.sign, Sign::Negative);
        let expected = ("torque_constant_nm_per_a", "N·m/A", &mut 0.75);
        assert_eq!(proportional_value(&mut torque.clone()), expected);
        assert!(torque.provenance.as_str().contains("± 0.0050 N·m/A, by a load of 2.5 kg"));
        // An unidentifiable gain stays.
        let unidentifiable =
            FoundGain::new(&DriveGain { factor: None, ..gain }, Some(&drive), basis);
        assert_eq!(
            (unidentifiable.found, unidentifiable.cell_line, unidentifiable.configured),
            (None, None, 0.5)
        );
    }
}
