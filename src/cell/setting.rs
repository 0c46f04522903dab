//! Keys of the cell file that findings ask to change, with the values to write.

use core::fmt;
use std::path::Path;

use didim_drivers::units::{DriveSpec, Sign, TorqueScale};
use didim_dynamics::robot::{JointIndex, MotorIndex, TorqueTerm};
use didim_formats::Side;
use didim_identification::identification::{Change, Setting, SettingValue, Signal, SignalAxis};

use super::data::{DataColumns, DataSection};
use super::file::GearRatios;
use super::table::TableSection;
use super::unit::{OneOrEach, Unit};
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

    fn value(&self) -> SettingValue {
        SettingValue::Number(self.rounded())
    }
}

impl fmt::Display for Correction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { configured, value, standard_deviation } = *self;
        write!(f, "configured {configured}")?;
        // A sign has no uncertainty.
        if standard_deviation <= 0.0 {
            return Ok(());
        }
        let value = to_uncertainty(value, standard_deviation, MAX_DIGITS);
        let deviation = to_uncertainty(standard_deviation, standard_deviation, 2);
        write!(f, "; data {value} ± {deviation}")
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

/// Key of a number for all axes or one for each, with its configured value. `usual` is the value of
/// a missing key.
#[derive(Clone, Copy)]
struct AxisKey<'a> {
    section: &'a str,
    name: &'a str,
    configured: Option<&'a OneOrEach<f64>>,
    usual: f64,
}

impl AxisKey<'_> {
    fn path(&self) -> String {
        format!("{}.{}", self.section, self.name)
    }

    /// Returns the configured value of each axis. `None` if their number is wrong.
    fn values(&self, axes: usize) -> Option<Vec<f64>> {
        self.configured.map_or(Some(vec![self.usual; axes]), |of| of.of_each(axes))
    }
}

impl Cell {
    /// Returns the key of the cell or robot file whose value the data ask to change. `None` if no
    /// file has a single key for it, as with the zero of coupled motors, or if signals of several
    /// sources have several.
    pub fn setting(&self, sources: &[SignalSource], change: &Change) -> Option<Setting> {
        let mut settings = sources.iter().map(|source| self.setting_of_source(*source, change));
        let first = settings.next()??;
        settings.all(|other| other.as_ref() == Some(&first)).then_some(first)
    }

    fn setting_of_source(&self, source: SignalSource, change: &Change) -> Option<Setting> {
        let file: CellFile = toml::from_str(&self.configuration.cell).ok()?;
        match *change {
            Change::Gravity { gravity_m_s2, standard_deviation_m_s2 } => {
                return self.gravity_setting(gravity_m_s2, standard_deviation_m_s2);
            }
            Change::Exclude { term } => return self.excludes_setting(term),
            Change::DriveInertia { joint } => return self.drive_inertia_setting(joint),
            Change::Coupling { motor, joint, entry, standard_deviation } => {
                return self.coupling_setting(&file, motor, joint, [entry, standard_deviation]);
            }
            Change::KnownTorque { joint, factor, standard_deviation } => {
                return self.known_torque_setting(joint, [factor, standard_deviation]);
            }
            Change::Geometry { joint, key, offset, standard_deviation } => {
                return self.geometry_setting(joint, key, [offset, standard_deviation]);
            }
            Change::FrictionLaws { nuisance, relative_torque } => {
                // Results that are compared over time need one model.
                let is_open = source != SignalSource::Live && !self.chooses_friction;
                let share = 100.0 * relative_torque;
                let explanation =
                    format!("{nuisance}, configured none; data {share:.1} % of its torque");
                let value = SettingValue::Word("auto".to_owned());
                let key = "identification.friction".to_owned();
                return is_open.then(|| self.setting_of(key, value, explanation));
            }
            Change::Delay { axis, signal, delay_s, standard_deviation_s } => {
                let delay_s = [delay_s, standard_deviation_s];
                return self.delay_setting((&file, source), (axis, signal), delay_s);
            }
            Change::TorqueScale { .. }
            | Change::PositionScale { .. }
            | Change::Position { .. }
            | Change::Sign { .. } => {}
        }
        match (source, &self.bus, &file.data) {
            (SignalSource::Bus | SignalSource::Live, Some(bus), _) => {
                self.drive_setting(bus, &file, change)
            }
            (SignalSource::Table, None, Some(data)) => {
                let (columns, position) = (self.columns.as_ref()?, data.position.as_ref()?);
                let own =
                    [ColumnKeys::of_data(position), ColumnKeys::of_data(data.torque.as_ref()?)];
                self.table_setting(("data", columns.side), own, &columns.position.scales, change)
            }
            (SignalSource::OwnTable(side), ..) => {
                let keys = ColumnKeys::of_own(&file.table);
                let scales = &self.own_columns.position.scales;
                self.table_setting(("table", side), keys, scales, change)
            }
            (SignalSource::Bag, None, Some(data)) => self.bag_setting(data, change),
            _ => None,
        }
    }

    /// Returns the key of the gravity in a robot file, or in the section of a URDF.
    fn gravity_setting(
        &self,
        gravity_m_s2: [f64; 3],
        standard_deviation_m_s2: f64,
    ) -> Option<Setting> {
        let configured = self.robot.gravity_m_s2();
        let [value, configured] = match &self.urdf {
            Some(arm) => [gravity_m_s2, configured].map(|of| arm.vector_in_base_link(of)),
            None => [gravity_m_s2, configured],
        };
        let standard_deviation = standard_deviation_m_s2;
        let mut explanation = format!("configured {configured:?}");
        let mut rounded = value;
        // One of the main directions has no uncertainty.
        if standard_deviation > 0.0 {
            for (value, configured) in rounded.iter_mut().zip(configured) {
                // No minus before 0.
                *value =
                    Correction { configured, value: *value, standard_deviation }.rounded() + 0.0;
            }
            let deviation = to_uncertainty(standard_deviation, standard_deviation, 2);
            explanation += &format!("; data ± {deviation}");
        }
        let value = SettingValue::List(rounded.to_vec());
        if self.urdf.is_some() {
            return Some(self.setting_of("urdf.gravity_m_s2".to_owned(), value, explanation));
        }
        self.robot_setting("gravity_m_s2".to_owned(), value, explanation)
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

    /// Returns the key of the inertia of a joint's drive, in a robot file or for a joint of a URDF.
    fn drive_inertia_setting(&self, joint: JointIndex) -> Option<Setting> {
        let explanation = self.axis_text(SignalAxis::Joint(joint), "configured false");
        let value = SettingValue::Truth(true);
        if self.urdf.is_some() {
            let key = format!("urdf.joints.{}.drive_inertia", self.robot.joint_name(joint)?);
            return Some(self.setting_of(key, value, explanation));
        }
        self.robot_setting(format!("joint[{joint}].drive_inertia"), value, explanation)
    }

    /// Returns the key of an entry of the transmission. A URDF with one ratio for each joint gets
    /// rows.
    fn coupling_setting(
        &self,
        file: &CellFile,
        motor: MotorIndex,
        joint: JointIndex,
        [value, standard_deviation]: [f64; 2],
    ) -> Option<Setting> {
        let transmission = self.robot.transmission();
        let configured = transmission.row(motor.position())[joint.position()];
        let correction = Correction { configured, value, standard_deviation };
        let of_joint = self.axis_text(SignalAxis::Joint(joint), &correction);
        let explanation = format!("motor {motor}, {of_joint}");
        let entry = correction.value();
        let place = format!("[{motor}][{joint}]");
        if self.urdf.is_none() {
            return self.robot_setting(format!("transmission.rows{place}"), entry, explanation);
        }
        let key = "urdf.gear_ratios".to_owned();
        if let Some(GearRatios::Rows(_)) = file.urdf.as_ref()?.gear_ratios {
            return Some(self.setting_of(key + &place, entry, explanation));
        }
        let mut rows = transmission.rows();
        rows[motor.position()][joint.position()] = correction.rounded();
        Some(self.setting_of(key, SettingValue::Rows(rows), explanation))
    }

    /// Returns the key of the factor of a known torque, in a robot file or for a joint of a URDF.
    fn known_torque_setting(
        &self,
        joint: JointIndex,
        [factor, standard_deviation]: [f64; 2],
    ) -> Option<Setting> {
        let configured = self.robot.known_torques()[joint.position()].as_ref()?.factor();
        let correction = Correction {
            configured,
            value: configured * factor,
            standard_deviation: configured.abs() * standard_deviation,
        };
        let explanation = self.axis_text(SignalAxis::Joint(joint), &correction);
        let value = correction.value();
        if self.urdf.is_some() {
            let key = format!("urdf.joints.{}.known_torque.factor", self.robot.joint_name(joint)?);
            return Some(self.setting_of(key, value, explanation));
        }
        self.robot_setting(format!("joint[{joint}].known_torque.factor"), value, explanation)
    }

    /// Returns the key of a length or angle of a joint in a robot file. A URDF has its own
    /// geometry.
    fn geometry_setting(
        &self,
        joint: JointIndex,
        key: &str,
        [offset, standard_deviation]: [f64; 2],
    ) -> Option<Setting> {
        let described = self.robot.chain()[joint];
        let configured = match key {
            "alpha_deg" => described.alpha.sin.atan2(described.alpha.cos).to_degrees(),
            "d_m" => described.d_m,
            _ => described.r_m,
        };
        let correction = Correction { configured, value: configured + offset, standard_deviation };
        let explanation = self.axis_text(SignalAxis::Joint(joint), &correction);
        let value = correction.value();
        match self.urdf {
            Some(_) => None,
            None => self.robot_setting(format!("joint[{joint}].{key}"), value, explanation),
        }
    }

    /// Returns the key of the delays of a signal.
    fn delay_setting(
        &self,
        (file, source): (&CellFile, SignalSource),
        (of, signal): (Option<SignalAxis>, Signal),
        [delay_s, standard_deviation_s]: [f64; 2],
    ) -> Option<Setting> {
        let (section, side, [position, torque]) = match (&file.bus, &file.data) {
            (Some(bus), _) => ("bus", Side::Motor, [&bus.position_delay_us, &bus.torque_delay_us]),
            (None, Some(data)) => {
                // didim's own columns have the side in their names.
                let side = data.side.unwrap_or(Side::Motor);
                ("data", side, [&data.position_delay_us, &data.torque_delay_us])
            }
            (None, None) => return None,
        };
        let (name, configured) = match signal {
            Signal::Torque => ("torque_delay_us", torque),
            Signal::Position => ("position_delay_us", position),
            Signal::Both => return None,
        };
        let side = match source {
            SignalSource::OwnTable(own) => own,
            _ => side,
        };
        let key = AxisKey { section, name, configured: configured.as_ref(), usual: 0.0 };
        let in_us = |time_s: f64| 1e6 * time_s;
        self.axis_setting(key, (of, side), |configured| Correction {
            configured,
            value: configured + in_us(delay_s),
            standard_deviation: in_us(standard_deviation_s),
        })
    }

    /// Returns the key of the columns of tables. `scales` are the SI values of a 1 in the columns
    /// of positions.
    fn table_setting(
        &self,
        (section, side): (&str, Side),
        [position, torque]: [ColumnKeys<'_>; 2],
        scales: &[f64],
        change: &Change,
    ) -> Option<Setting> {
        let [of_position, of_torque] = ["position", "torque"].map(|of| format!("{section}.{of}"));
        match *change {
            Change::TorqueScale { axis, .. } => {
                self.scale_setting((&of_torque, torque.scale), (axis, side), change)
            }
            Change::PositionScale { axis, .. } => {
                self.scale_setting((&of_position, position.scale), (Some(axis), side), change)
            }
            Change::Position { joint, offset, standard_deviation } => {
                let axis = self.axis(SignalAxis::Joint(joint), side)?;
                let unit = axis.ratio / scales.get(axis.index)?;
                let configured = position.zero;
                let key = AxisKey { section: &of_position, name: "zero", configured, usual: 0.0 };
                self.axis_setting(key, (Some(SignalAxis::Joint(joint)), side), |configured| {
                    Correction {
                        configured,
                        value: configured - unit * offset,
                        standard_deviation: (unit * standard_deviation).abs(),
                    }
                })
            }
            Change::Sign { axis, signal } => {
                let (section, of) = match signal {
                    Signal::Torque => (&of_torque, torque),
                    Signal::Position => (&of_position, position),
                    Signal::Both => return None,
                };
                self.sign_setting(section, of.sign, (axis, side))
            }
            _ => None,
        }
    }

    /// Returns the key of the efforts of bags.
    fn bag_setting(&self, data: &DataSection, change: &Change) -> Option<Setting> {
        let (effort, side) = (&data.bag.as_ref()?.effort, self.bag.as_ref()?.side);
        match *change {
            Change::TorqueScale { axis, .. } => {
                let unit = Some(&effort.unit);
                let of = (unit, effort.per_ampere.as_ref(), effort.factor.as_ref());
                self.scale_setting(("data.bag.effort", of), (axis, side), change)
            }
            Change::Sign { axis, signal: Signal::Torque } => {
                self.sign_setting("data.bag.effort", effort.sign.as_ref(), (axis, side))
            }
            _ => None,
        }
    }

    /// Returns the axis of a signal. `None` for the joint of coupled motors, whose signals belong
    /// to several joints.
    fn axis(&self, of: SignalAxis, side: Side) -> Option<Axis> {
        let transmission = self.robot.transmission();
        match (of, side) {
            (SignalAxis::Joint(joint), Side::Joint) => {
                Some(Axis { index: joint.position(), ratio: 1.0 })
            }
            (SignalAxis::Motor(motor), Side::Motor) => {
                let index = motor.position();
                Some(Axis { index, ratio: transmission.row(index)[index] })
            }
            (SignalAxis::Joint(joint), Side::Motor) => {
                let index = self.own_motor(joint.position())?;
                Some(Axis { index, ratio: transmission.row(index)[joint.position()] })
            }
            (SignalAxis::Motor(motor), Side::Joint) => {
                let index = self.own_motor(motor.position())?;
                Some(Axis { index, ratio: 1.0 })
            }
        }
    }

    /// Returns the motor of a joint that is coupled to no other.
    fn own_motor(&self, joint: usize) -> Option<usize> {
        let transmission = self.robot.transmission();
        let mut motors = (0..self.robot.joints()).filter(|of| transmission.row(*of)[joint] != 0.0);
        let (index, others) = (motors.next()?, motors.next());
        (others.is_none() && !transmission.is_coupled(index)).then_some(index)
    }

    /// Returns the key of a drive on the bus, or of all drives.
    fn drive_setting(&self, bus: &CellBus, file: &CellFile, change: &Change) -> Option<Setting> {
        let of = match *change {
            Change::TorqueScale { axis: None, .. } => {
                let configured = file.bus.as_ref()?.torque_factor.map(OneOrEach::One);
                let configured = configured.as_ref();
                let key = AxisKey { section: "bus", name: "torque_factor", configured, usual: 1.0 };
                return self.axis_setting(key, (None, Side::Motor), |value| scaled(value, change));
            }
            Change::TorqueScale { axis: Some(axis), .. }
            | Change::PositionScale { axis, .. }
            | Change::Sign { axis, .. } => axis,
            Change::Position { joint, .. } => SignalAxis::Joint(joint),
            _ => return None,
        };
        let axis = self.axis(of, Side::Motor)?;
        let drive = bus.drives.get(axis.index)?;
        let number = |key: String, correction: Correction| {
            let explanation = self.axis_text(of, &correction);
            Some(self.setting_of(axis.drive_key(&key), correction.value(), explanation))
        };
        match *change {
            Change::TorqueScale { .. } => {
                let (key, configured) = proportional_key(drive);
                number(format!("torque.{key}"), scaled(configured, change))
            }
            Change::PositionScale { .. } => {
                number("position.factor".to_owned(), scaled(drive.position.factor, change))
            }
            Change::Position { offset, standard_deviation, .. } => {
                let unit = axis.ratio * bus.scales.position_per_rad(axis.index);
                let correction = Correction {
                    configured: drive.position.zero,
                    value: drive.position.zero - unit * offset,
                    standard_deviation: (unit * standard_deviation).abs(),
                };
                number("position.zero".to_owned(), correction)
            }
            Change::Sign { signal, .. } => {
                let (key, sign) = match signal {
                    Signal::Torque => ("torque.sign", drive.torque.sign),
                    Signal::Position => ("position.sign", drive.position.sign),
                    Signal::Both => return None,
                };
                let configured = if sign == Sign::Positive { 1 } else { -1 };
                let explanation = self.axis_text(of, format_args!("configured {configured}"));
                let value = SettingValue::Integer(-configured);
                Some(self.setting_of(axis.drive_key(key), value, explanation))
            }
            _ => None,
        }
    }

    /// Returns the key of a scale: `per_ampere` if the axis is given in amperes, else `factor`.
    fn scale_setting(
        &self,
        (section, (unit, per_ampere, factor)): (&str, ScaleKeys<'_>),
        (of, side): (Option<SignalAxis>, Side),
        change: &Change,
    ) -> Option<Setting> {
        let units = unit.map_or(Some(Vec::new()), |unit| unit.of_each(self.robot.joints()))?;
        let in_amperes = match of {
            Some(of) => units.get(self.axis(of, side)?.index).is_some_and(Unit::is_current),
            None => units.iter().all(Unit::is_current),
        };
        let (name, configured) = match in_amperes && per_ampere.is_some() {
            true => ("per_ampere", per_ampere),
            false => ("factor", factor),
        };
        let key = AxisKey { section, name, configured, usual: 1.0 };
        self.axis_setting(key, (of, side), |configured| scaled(configured, change))
    }

    /// Returns an entry of a list with one number for each axis. A number that stands for all axes
    /// becomes a list, and so does a missing key. Without an axis, all of them change.
    fn axis_setting(
        &self,
        key: AxisKey<'_>,
        (of, side): (Option<SignalAxis>, Side),
        corrected: impl Fn(f64) -> Correction,
    ) -> Option<Setting> {
        let mut values = key.values(self.robot.joints())?;
        let path = key.path();
        let is_list = matches!(key.configured, Some(OneOrEach::Each(_)));
        let Some(of) = of else {
            let first = corrected(*values.first()?);
            let value = match is_list {
                true => SettingValue::List(
                    values.iter().map(|value| corrected(*value).rounded()).collect(),
                ),
                false => SettingValue::Number(first.rounded()),
            };
            return Some(self.setting_of(path, value, format!("all axes, {first}")));
        };
        let axis = self.axis(of, side)?;
        let correction = corrected(*values.get(axis.index)?);
        let explanation = self.axis_text(of, &correction);
        if is_list {
            let key = format!("{path}[{}]", axis.index + 1);
            return Some(self.setting_of(key, correction.value(), explanation));
        }
        values[axis.index] = correction.rounded();
        Some(self.setting_of(path, SettingValue::List(values), explanation))
    }

    /// Returns the opposite sign of an axis.
    fn sign_setting(
        &self,
        section: &str,
        configured: Option<&OneOrEach<f64>>,
        (of, side): (SignalAxis, Side),
    ) -> Option<Setting> {
        let key = AxisKey { section, name: "sign", configured, usual: 1.0 };
        let opposite = |configured: f64| Correction {
            configured,
            value: -configured,
            standard_deviation: 0.0,
        };
        self.axis_setting(key, (Some(of), side), opposite)
    }

    fn axis_label(&self, of: SignalAxis) -> String {
        match of {
            SignalAxis::Joint(joint) => format!("joint {}", self.robot.joint_label(joint)),
            SignalAxis::Motor(motor) => {
                let joint = JointIndex::new(motor.position());
                match self.robot.joint_name(joint) {
                    Some(name) => format!("motor {motor} of {name}"),
                    None => format!("motor {motor}"),
                }
            }
        }
    }

    /// Returns an explanation that begins with the axis.
    fn axis_text(&self, of: SignalAxis, text: impl fmt::Display) -> String {
        format!("{}, {text}", self.axis_label(of))
    }

    fn setting_of(&self, key: String, value: SettingValue, explanation: String) -> Setting {
        let line = line_of_entry(&self.configuration.cell, &key);
        // Results do not depend on the folder of the cell.
        Setting { file: name_of(&self.file), line: line.unwrap_or(1), key, value, explanation }
    }

    /// Returns a key of the robot file.
    fn robot_setting(
        &self,
        key: String,
        value: SettingValue,
        explanation: String,
    ) -> Option<Setting> {
        let line = line_of_entry(&self.configuration.robot, &key)?;
        Some(Setting { file: name_of(&self.robot_file), line, key, value, explanation })
    }
}

/// Unit of a quantity, torque per ampere, and correction of the scale.
type ScaleKeys<'a> =
    (Option<&'a OneOrEach<Unit>>, Option<&'a OneOrEach<f64>>, Option<&'a OneOrEach<f64>>);

/// Keys of the columns of one quantity.
#[derive(Clone, Copy)]
struct ColumnKeys<'a> {
    scale: ScaleKeys<'a>,
    sign: Option<&'a OneOrEach<f64>>,
    zero: Option<&'a OneOrEach<f64>>,
}

impl<'a> ColumnKeys<'a> {
    fn of_data(columns: &'a DataColumns) -> Self {
        let DataColumns { unit, per_ampere, factor, sign, zero, .. } = columns;
        let scale = (Some(unit), per_ampere.as_ref(), factor.as_ref());
        Self { scale, sign: sign.as_ref(), zero: zero.as_ref() }
    }

    /// Returns the keys of didim's own columns of positions and torques, which are in SI units.
    fn of_own(TableSection { position, torque }: &'a TableSection) -> [Self; 2] {
        let scale = |factor: &'a Option<OneOrEach<f64>>| (None, None, factor.as_ref());
        [
            Self {
                scale: scale(&position.factor),
                sign: position.sign.as_ref(),
                zero: position.zero.as_ref(),
            },
            Self { scale: scale(&torque.factor), sign: torque.sign.as_ref(), zero: None },
        ]
    }
}

/// Returns a number that is multiplied by the factor of a change.
fn scaled(configured: f64, change: &Change) -> Correction {
    let (factor, deviation) = match *change {
        Change::TorqueScale { factor, standard_deviation, .. }
        | Change::PositionScale { factor, standard_deviation, .. } => (factor, standard_deviation),
        _ => (1.0, 0.0),
    };
    Correction {
        configured,
        value: configured * factor,
        standard_deviation: (configured * deviation).abs(),
    }
}

/// Returns the line of a key. Places of the file name the entries of a list by numbers, as
/// `bus.drives.2`.
fn line_of_entry(text: &str, key: &str) -> Option<usize> {
    open::line_of(text, &key.replace('[', ".").replace(']', ""))
}

fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or(file.as_os_str()).display().to_string()
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
