//! Keys of the cell file that findings ask to change, with the values to write.

use didim_drivers::units::{DriveSpec, Sign, TorqueScale};
use didim_dynamics::robot::{JointIndex, TorqueTerm};
use didim_formats::Side;
use didim_identification::identification::{Change, Setting, SettingValue, Signal};

use super::data::DataSection;
use super::unit::OneOrEach;
use super::{Cell, CellBus, CellFile, SignalSource, open};
use crate::text::to_uncertainty;

/// Maximum number of digits of a value.
const MAX_DIGITS: usize = 6;

/// A number of a file, with its value from the data.
struct Correction {
    configured: f64,
    value: f64,
    standard_deviation: f64,
}

impl Correction {
    /// Returns the value with the digits that its standard deviation justifies.
    fn rounded(&self) -> f64 {
        let text = to_uncertainty(self.value, self.standard_deviation, MAX_DIGITS);
        text.parse().unwrap_or(self.value)
    }
}

/// An axis, and the ratio of its position to that of the joint.
#[derive(Clone, Copy)]
struct Axis {
    index: usize,
    ratio: f64,
}

impl Axis {
    /// Returns the path of a key of its drive.
    fn drive_key(self, key: &str) -> String {
        format!("bus.drives[{}].{key}", self.index + 1)
    }
}

impl Cell {
    /// Returns the key of this cell file whose value the data ask to change. `None` if the file has
    /// no single key for it, as with coupled motors.
    pub fn setting(&self, source: SignalSource, change: &Change) -> Option<Setting> {
        match change {
            Change::Gravity { gravity_m_s2 } => return self.gravity_setting(*gravity_m_s2),
            Change::Exclude { term } => return self.excludes_setting(*term),
            _ => {}
        }
        let file: CellFile = toml::from_str(&self.configuration.cell).ok()?;
        match (source, &self.bus, &file.data) {
            (SignalSource::Bus, Some(bus), _) => self.drive_setting(bus, change),
            (SignalSource::Table, None, Some(data)) => self.table_setting(data, change),
            (SignalSource::Bag, None, Some(data)) => self.bag_setting(data, change),
            _ => None,
        }
    }

    /// Returns the key of the gravity in a robot file, or in the section of a URDF.
    fn gravity_setting(&self, gravity_m_s2: [f64; 3]) -> Option<Setting> {
        if let Some(arm) = &self.urdf {
            let [value, configured] = [gravity_m_s2, self.robot.gravity_m_s2()]
                .map(|gravity| arm.vector_in_base_link(gravity));
            let explanation = format!("configured {configured:?}");
            let value = SettingValue::List(value.to_vec());
            return Some(self.setting_of("urdf.gravity_m_s2".to_owned(), value, explanation));
        }
        let (text, key) = (&self.configuration.robot, "gravity_m_s2");
        let file = self.robot_file.file_name().unwrap_or(self.robot_file.as_os_str());
        Some(Setting {
            file: file.display().to_string(),
            line: open::line_of(text, key)?,
            key: key.to_owned(),
            value: SettingValue::List(gravity_m_s2.to_vec()),
            explanation: format!("configured {:?}", self.robot.gravity_m_s2()),
        })
    }

    /// Returns the key of the terms that the recorded torques do not contain.
    fn excludes_setting(&self, term: TorqueTerm) -> Option<Setting> {
        let key = match &self.bus {
            Some(_) => "bus.layout.excludes",
            None => "data.excludes",
        };
        let configured = self.robot.recorded_torque().excluded_terms();
        let words = configured.iter().chain([&term]).map(TorqueTerm::to_string).collect();
        let explanation = match configured {
            [] => "configured none".to_owned(),
            terms => format!("configured {terms:?}"),
        };
        Some(self.setting_of(key.to_owned(), SettingValue::Words(words), explanation))
    }

    /// Returns the key of the columns of tables.
    fn table_setting(&self, data: &DataSection, change: &Change) -> Option<Setting> {
        let columns = self.columns.as_ref()?;
        let (position, torque) = (data.position.as_ref()?, data.torque.as_ref()?);
        match change {
            Change::TorqueScale { .. } => {
                let keys = [torque.per_ampere.as_ref(), torque.factor.as_ref()];
                self.scale_setting("data.torque", &keys, columns.side, change)
            }
            Change::Position { joint, offset, standard_deviation } => {
                let axis = self.axis(*joint, columns.side)?;
                let unit = axis.ratio / columns.position.scales.get(axis.index)?;
                let zero = columns.position.zeros.get(axis.index).copied();
                let configured = zero.unwrap_or_default();
                let correction = Correction {
                    configured,
                    value: configured - unit * offset,
                    standard_deviation: (unit * standard_deviation).abs(),
                };
                let key = ("data.position", "zero", position.zero.as_ref());
                let explanation = self.explanation(*joint, &correction);
                Some(self.list_setting(key, 0.0, axis, correction.rounded(), explanation))
            }
            Change::Sign { joint, signal } => {
                let (section, of) = match signal {
                    Signal::Torque => ("data.torque", torque),
                    Signal::Position => ("data.position", position),
                    Signal::Both => return None,
                };
                let axis = self.axis(*joint, columns.side)?;
                self.sign_setting((section, "sign", of.sign.as_ref()), axis, *joint)
            }
            Change::Exclude { .. } | Change::Gravity { .. } => None,
        }
    }

    /// Returns the key of the efforts of bags.
    fn bag_setting(&self, data: &DataSection, change: &Change) -> Option<Setting> {
        let (effort, side) = (&data.bag.as_ref()?.effort, self.bag.as_ref()?.side);
        match change {
            Change::TorqueScale { .. } => {
                let keys = [effort.per_ampere.as_ref(), effort.factor.as_ref()];
                self.scale_setting("data.bag.effort", &keys, side, change)
            }
            Change::Sign { joint, signal: Signal::Torque } => {
                let key = ("data.bag.effort", "sign", effort.sign.as_ref());
                self.sign_setting(key, self.axis(*joint, side)?, *joint)
            }
            Change::Sign { .. }
            | Change::Position { .. }
            | Change::Exclude { .. }
            | Change::Gravity { .. } => None,
        }
    }

    /// Returns the axis of a joint. `None` for coupled motors, whose signals belong to several
    /// joints.
    fn axis(&self, joint: JointIndex, side: Side) -> Option<Axis> {
        let (transmission, at) = (self.robot.transmission(), joint.position());
        if side == Side::Joint {
            return Some(Axis { index: at, ratio: 1.0 });
        }
        let mut motors =
            (0..self.robot.joints()).filter(|motor| transmission.row(*motor)[at] != 0.0);
        let (index, others) = (motors.next()?, motors.next());
        let is_alone = others.is_none() && !transmission.is_coupled(index);
        is_alone.then(|| Axis { index, ratio: transmission.row(index)[at] })
    }

    /// Returns the key of a drive on the bus.
    fn drive_setting(&self, bus: &CellBus, change: &Change) -> Option<Setting> {
        let (Change::TorqueScale { joint: Some(joint), .. }
        | Change::Position { joint, .. }
        | Change::Sign { joint, .. }) = change
        else {
            return None;
        };
        let axis = self.axis(*joint, Side::Motor)?;
        let drive = bus.drives.get(axis.index)?;
        match change {
            Change::TorqueScale { factor, standard_deviation, .. } => {
                let (key, configured) = proportional_key(drive);
                let correction = Correction {
                    configured,
                    value: configured * factor,
                    standard_deviation: configured * standard_deviation,
                };
                Some(self.number_setting(axis, &format!("torque.{key}"), &correction, *joint))
            }
            Change::Position { offset, standard_deviation, .. } => {
                let unit = axis.ratio * bus.scales.position_per_rad(axis.index);
                let correction = Correction {
                    configured: drive.position.zero,
                    value: drive.position.zero - unit * offset,
                    standard_deviation: (unit * standard_deviation).abs(),
                };
                Some(self.number_setting(axis, "position.zero", &correction, *joint))
            }
            Change::Sign { signal, .. } => {
                let (key, sign) = match signal {
                    Signal::Torque => ("torque.sign", drive.torque.sign),
                    Signal::Position => ("position.sign", drive.position.sign),
                    Signal::Both => return None,
                };
                let configured = if sign == Sign::Positive { 1 } else { -1 };
                let explanation = self.configured_text(*joint, configured);
                let value = SettingValue::Integer(-configured);
                Some(self.setting_of(axis.drive_key(key), value, explanation))
            }
            Change::Exclude { .. } | Change::Gravity { .. } => None,
        }
    }

    /// Returns the key of a number of a drive.
    fn number_setting(
        &self,
        axis: Axis,
        key: &str,
        correction: &Correction,
        joint: JointIndex,
    ) -> Setting {
        let value = SettingValue::Number(correction.rounded());
        self.setting_of(axis.drive_key(key), value, self.explanation(joint, correction))
    }

    /// Returns the key of a torque scale: `per_ampere` if the cell has it, else `factor`.
    fn scale_setting(
        &self,
        section: &str,
        [per_ampere, factor]: &[Option<&OneOrEach<f64>>; 2],
        side: Side,
        change: &Change,
    ) -> Option<Setting> {
        let Change::TorqueScale { joint, factor: by, standard_deviation } = change else {
            return None;
        };
        let (name, configured) = match per_ampere {
            Some(_) => ("per_ampere", *per_ampere),
            None => ("factor", *factor),
        };
        let axes = self.robot.joints();
        let values = configured.map_or(Some(vec![1.0; axes]), |of| of.of_each(axes))?;
        let corrected = |value: f64| Correction {
            configured: value,
            value: value * by,
            standard_deviation: value * standard_deviation,
        };
        if let Some(joint) = joint {
            let axis = self.axis(*joint, side)?;
            let correction = corrected(*values.get(axis.index)?);
            let (key, value) = ((section, name, configured), correction.rounded());
            let explanation = self.explanation(*joint, &correction);
            return Some(self.list_setting(key, 1.0, axis, value, explanation));
        }
        let value = match configured {
            Some(OneOrEach::Each(_)) => {
                SettingValue::List(values.iter().map(|of| corrected(*of).rounded()).collect())
            }
            _ => SettingValue::Number(corrected(*values.first()?).rounded()),
        };
        let explanation = format!("all joints, {by:.3} times the configured value");
        Some(self.setting_of(format!("{section}.{name}"), value, explanation))
    }

    /// Returns an entry of a list with one number for each axis. A number that stands for all axes
    /// becomes a list, and so does a missing key, whose default is `usual`.
    fn list_setting(
        &self,
        (section, name, configured): (&str, &str, Option<&OneOrEach<f64>>),
        usual: f64,
        axis: Axis,
        value: f64,
        explanation: String,
    ) -> Setting {
        let key = format!("{section}.{name}");
        let all = match configured {
            Some(OneOrEach::Each(_)) => {
                let key = format!("{key}[{}]", axis.index + 1);
                return self.setting_of(key, SettingValue::Number(value), explanation);
            }
            Some(OneOrEach::One(one)) => *one,
            None => usual,
        };
        let mut values = vec![all; self.robot.joints()];
        values[axis.index] = value;
        self.setting_of(key, SettingValue::List(values), explanation)
    }

    /// Returns the opposite sign of an axis.
    fn sign_setting(
        &self,
        key: (&str, &str, Option<&OneOrEach<f64>>),
        axis: Axis,
        joint: JointIndex,
    ) -> Option<Setting> {
        let axes = self.robot.joints();
        let signs = key.2.map_or(Some(vec![1.0; axes]), |of| of.of_each(axes))?;
        let configured = *signs.get(axis.index)?;
        let explanation = self.configured_text(joint, configured);
        Some(self.list_setting(key, 1.0, axis, -configured, explanation))
    }

    fn configured_text(&self, joint: JointIndex, configured: impl core::fmt::Display) -> String {
        format!("joint {}, configured {configured}", self.robot.joint_label(joint))
    }

    fn explanation(&self, joint: JointIndex, correction: &Correction) -> String {
        let Correction { configured, value, standard_deviation } = correction;
        format!(
            "{}; data {} ± {}",
            self.configured_text(joint, configured),
            to_uncertainty(*value, *standard_deviation, MAX_DIGITS),
            to_uncertainty(*standard_deviation, *standard_deviation, 2)
        )
    }

    fn setting_of(&self, key: String, value: SettingValue, explanation: String) -> Setting {
        // Places of the file name the entries of a list by numbers, as `bus.drives.2`.
        let place = key.replace('[', ".").replace(']', "");
        let line = open::line_of(&self.configuration.cell, &place).unwrap_or(1);
        // Results do not depend on the folder of the cell.
        let file = self.file.file_name().unwrap_or(self.file.as_os_str());
        Setting { file: file.display().to_string(), line, key, value, explanation }
    }
}

/// Returns the key of the number that the torque of a drive is proportional to, with its value.
fn proportional_key(drive: &DriveSpec) -> (&'static str, f64) {
    match drive.torque.scale {
        TorqueScale::PerMilleOfRatedTorque { rated_torque_nm } => {
            ("scale.per_mille_of_rated_torque.rated_torque_nm", rated_torque_nm)
        }
        TorqueScale::PerMilleOfRatedCurrent { torque_constant_nm_per_a, .. } => {
            ("scale.per_mille_of_rated_current.torque_constant_nm_per_a", torque_constant_nm_per_a)
        }
        TorqueScale::NmPerCount(torque) => ("scale.nm_per_count", torque),
        TorqueScale::NmPerA(torque) => ("scale.nm_per_a", torque),
        TorqueScale::Nm => ("factor", drive.torque.factor),
    }
}
