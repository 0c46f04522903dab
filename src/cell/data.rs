//! `[data]`: recordings of other programs, for a cell without a bus.

use core::ops::RangeInclusive;

use didim_drivers::layout::TorqueValidity;
use didim_dynamics::SignalTiming;
use didim_dynamics::robot::{JointKind, Robot, TorqueTerm};
use didim_formats::{
    AXIS_PLACEHOLDER, AxisColumns, BagSpec, BagTime, Columns, INDEX_PLACEHOLDER, Side, TimeColumns,
};
use didim_identification::identification::SignalDelays;
use schemars::JsonSchema;
use serde::Deserialize;

use super::unit::{
    OneOrEach, POSITION_UNITS, QuantityUnits, TORQUE_UNITS, TorqueUnit, Unit, numbers, wrong_count,
};

/// Tables (CSV) of measured signals. Without columns, they have didim's own: `motor_position_rad_1`
/// and so on.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSection {
    /// Samples per second \[Hz\]; 1 to 20 000.
    pub rate_hz: f64,
    /// When a torque is valid: `"instant"`, that of the sample itself, as a measured one; `{ held =
    /// { … } }`, a command that acts until the next one.
    pub torque_valid: TorqueValidity,
    /// The side of the transmission on which the signals were measured: those of the motors, or of
    /// the joints. Required with columns or a bag.
    ///
    /// If left out: from the names of didim's own columns.
    #[serde(default)]
    pub side: Option<Side>,
    /// The column of the time.
    ///
    /// If left out: the rows are `rate_hz` apart.
    #[serde(default)]
    pub time: Option<TimeColumn>,
    /// Positions.
    ///
    /// If left out: didim's own columns.
    #[serde(default)]
    pub position: Option<DataColumns>,
    /// Torques, forces or currents.
    ///
    /// If left out: didim's own columns.
    #[serde(default)]
    pub torque: Option<DataColumns>,
    /// Terms that the recorded torques do not contain, because the driver subtracted them:
    /// `["gravity"]`, `["friction"]` or both. The model of these torques has no such term.
    #[serde(default)]
    pub excludes: Vec<TorqueTerm>,
    /// Time from a row to the instant at which its positions are valid, negative if they are logged
    /// late; one for all axes or one for each \[µs\]; −500 000 to 500 000.
    ///
    /// If left out: 0.
    #[serde(default)]
    pub position_delay_us: Option<OneOrEach<f64>>,
    /// The same of the torques, in addition to the delay in `torque_valid` \[µs\].
    ///
    /// If left out: 0.
    #[serde(default)]
    pub torque_delay_us: Option<OneOrEach<f64>>,
    /// Commanded positions. `sign`, `zero` and `wraps` that are left out are those of `position`.
    ///
    /// If left out: none.
    #[serde(default)]
    pub reference: Option<DataColumns>,
    /// Joint states of ROS 2 bags.
    ///
    /// If left out: no bags.
    #[serde(default)]
    pub bag: Option<BagSection>,
}

/// `[data.bag]`
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BagSection {
    /// Names of the joints in the messages, in the arm's order. Required with a robot file.
    ///
    /// If left out: those of the URDF.
    #[serde(default)]
    pub joints: Option<Vec<String>>,
    /// The topic to read if several topics contain these joints.
    ///
    /// If left out: the only one with these joints.
    #[serde(default)]
    pub topic: Option<String>,
    /// True for joints whose position jumps from half a turn to minus half a turn: it is unwrapped.
    ///
    /// If left out: true for the continuous joints of a URDF, on the joint side.
    #[serde(default)]
    pub wraps: Option<OneOrEach<bool>>,
    /// The unit of `effort`, which no bag states, and its sign.
    pub effort: EffortSection,
    /// The time to use: the stamps in the messages, the time at which they were recorded, or none,
    /// so that each message is one row of `rate_hz`.
    #[serde(default)]
    pub time: BagTime,
}

/// `effort` of `[data.bag]`.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a unit such as { unit = \"Nm\" }")]
pub struct EffortSection {
    /// `"Nm"`, `"mNm"`, `"Ncm"`, `"kNm"`; of a prismatic joint `"N"`, `"kN"`; `"A"` or `"mA"`, of a
    /// current. Another unit by its size in N·m or N: `{ name = "%", si = 1.2 }`.
    pub unit: OneOrEach<Unit>,
    /// Torque or force of one ampere, for a current \[N·m/A or N/A\].
    ///
    /// Required with a current.
    #[serde(default)]
    pub per_ampere: Option<OneOrEach<f64>>,
    /// 1 if effort drives the joint, −1 if it is the reaction on the link before.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub sign: Option<OneOrEach<f64>>,
    /// Correction of the scale: the torque in SI units is `sign × factor × unit × value`. Above 0.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub factor: Option<OneOrEach<f64>>,
}

/// The time: one column, or a stamp in two columns.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a column such as { column = \"t\", unit = \"ms\" }")]
pub struct TimeColumn {
    /// The name of the column, or its number, from 1.
    ///
    /// If left out: `sec` and `nanosec`.
    #[serde(default)]
    pub column: Option<ColumnName>,
    /// Its unit: `"s"`, `"ms"`, `"us"`, `"ns"`; `"iso8601"`, of dates as
    /// 2024-05-01T12:00:00.123456Z.
    ///
    /// If left out: `sec` and `nanosec`.
    #[serde(default)]
    pub unit: Option<String>,
    /// The column of the whole seconds of a stamp in two columns [s].
    ///
    /// If left out: `column` and `unit`.
    #[serde(default)]
    pub sec: Option<ColumnName>,
    /// The column of the nanoseconds beyond them [ns].
    ///
    /// If left out: `column` and `unit`.
    #[serde(default)]
    pub nanosec: Option<ColumnName>,
}

/// The columns of one quantity.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "columns such as { column = \"actual_q_{axis}\", unit = \"deg\" }"
)]
pub struct DataColumns {
    /// The name of the columns, with `{axis}` (from 1) or `{index}` (from 0) in place of the
    /// number.
    ///
    /// If left out: `columns` names them.
    #[serde(default)]
    pub column: Option<ColumnName>,
    /// A name for each axis, in the arm's order, or a number for each, from 1: `[2, 3]`. An element
    /// of a list in a field has an index, from 0: `"position[0]"`.
    ///
    /// If left out: `column` names them.
    #[serde(default)]
    pub columns: Option<Vec<ColumnName>>,
    /// The unit of the columns. Positions: `"rad"`, `"deg"`, `"rev"`, `"mrad"`, `"mdeg"`; of a
    /// prismatic joint `"m"`, `"mm"`, `"um"`. Torques: `"Nm"`, `"mNm"`, `"Ncm"`, `"kNm"`; of a
    /// prismatic joint `"N"`, `"kN"`; of a current `"A"`, `"mA"`. Any other unit by its size in
    /// rad, m, N·m or N: `{ name = "count", si = 1.5e-4 }`.
    pub unit: OneOrEach<Unit>,
    /// Torque or force of one ampere, for a current \[N·m/A or N/A\], on the side of the
    /// transmission that `side` names. Not for positions.
    ///
    /// Required with a current.
    #[serde(default)]
    pub per_ampere: Option<OneOrEach<f64>>,
    /// 1 if the signal is positive in the robot's positive direction, −1 if not.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub sign: Option<OneOrEach<f64>>,
    /// Correction of the scale: the value in SI units is `sign × factor × unit × (value − zero)`.
    /// Above 0.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub factor: Option<OneOrEach<f64>>,
    /// The value of the column at which the position of the robot file is 0, in the unit of the
    /// column. Not for torques.
    ///
    /// If left out: 0.
    #[serde(default)]
    pub zero: Option<OneOrEach<f64>>,
    /// True if the angles wrap at a turn, as from −180° to 180°. They are unwrapped, from within
    /// half a turn of 0. Not for torques.
    ///
    /// If left out: true for the continuous joints of a URDF, on the joint side.
    #[serde(default)]
    pub wraps: Option<OneOrEach<bool>>,
}

/// The name of a column, or its number, from 1.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "the name of a column, or its number, from 1")]
pub enum ColumnName {
    /// The number.
    Number(u16),
    /// The name.
    Name(String),
}

impl DataColumns {
    /// Returns the columns with the sign and the wraps of the measured positions where they have
    /// none of their own: one drive counts both in the same way.
    fn with_convention_of(&self, position: &Self) -> Self {
        Self {
            sign: self.sign.clone().or_else(|| position.sign.clone()),
            wraps: self.wraps.clone().or_else(|| position.wraps.clone()),
            ..self.clone()
        }
    }
}

/// Returns columns whose zeros are those of the measured positions, in their own units.
fn with_zeros_of(position: &AxisColumns, columns: AxisColumns) -> AxisColumns {
    let scales = position.scales.iter().zip(&columns.scales);
    let zeros = position.zeros.iter().zip(scales);
    let zeros = zeros.map(|(zero, (of_position, own))| zero * (of_position / own).abs()).collect();
    AxisColumns { zeros, ..columns }
}

impl ColumnName {
    fn text(&self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Name(name) => name.clone(),
        }
    }
}

/// Recordings of other programs, validated.
#[derive(Clone, Debug)]
pub(super) struct RecordingFormat {
    pub(super) rate_hz: f64,
    pub(super) torque_timing: SignalTiming,
    pub(super) signal_delays: SignalDelays,
    pub(super) columns: Option<Columns>,
    pub(super) bag: Option<BagSpec>,
}

/// Key of an invalid value, and the problem.
type Wrong = (&'static str, String);

/// Range of plausible sample rates.
const RATES_HZ: RangeInclusive<f64> = 1.0..=20_000.0;

/// Unit that means dates as text.
pub(crate) const DATE_UNIT: &str = "iso8601";
const TIME_UNITS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

impl DataSection {
    /// Returns the sampling, the columns of tables and the joints of bags. `named` are the joint
    /// names of a URDF, and `continuous` those that turn without end.
    pub(super) fn read(
        &self,
        robot: &Robot,
        named: &[String],
        continuous: &[&str],
    ) -> Result<RecordingFormat, Wrong> {
        if !RATES_HZ.contains(&self.rate_hz) {
            let (least, most) = (RATES_HZ.start(), RATES_HZ.end());
            let problem =
                format!("is {}; give the samples per second, {least} to {most}", self.rate_hz);
            return Err(("data.rate_hz", problem));
        }
        if self.torque_valid == TorqueValidity::Arrival {
            let problem =
                "\"arrival\" is for frames of a bus; a row has one time: say \"instant\" or held";
            return Err(("data.torque_valid", problem.to_owned()));
        }
        let torque_timing = self.torque_valid.timing(self.rate_hz);
        let wraps: Vec<bool> =
            named.iter().map(|joint| continuous.contains(&joint.as_str())).collect();
        Ok(RecordingFormat {
            rate_hz: self.rate_hz,
            torque_timing: torque_timing.map_err(|problem| ("data.torque_valid", problem))?,
            signal_delays: SignalDelays {
                position_s: delays_s(self.position_delay_us.as_ref(), robot.joints())
                    .map_err(|problem| ("data.position_delay_us", problem))?,
                torque_s: delays_s(self.torque_delay_us.as_ref(), robot.joints())
                    .map_err(|problem| ("data.torque_delay_us", problem))?,
            },
            columns: self.columns(robot, &wraps)?,
            bag: self.bag_spec(robot, named, &wraps)?,
        })
    }

    /// Returns the columns for the robot's axes. `None` if the tables have didim's own format.
    fn columns(&self, robot: &Robot, continuous: &[bool]) -> Result<Option<Columns>, Wrong> {
        let (position, torque) = match (&self.position, &self.torque) {
            (Some(position), Some(torque)) => (position, torque),
            (None, None)
                if self.reference.is_none()
                    && self.time.is_none()
                    && (self.side.is_none() || self.bag.is_some()) =>
            {
                return Ok(None);
            }
            (None, _) => return Err(("data.position", "is missing; name its columns too".into())),
            (_, None) => return Err(("data.torque", "is missing; name its columns too".into())),
        };
        let side = self.transmission_side()?;
        let kinds = kinds(robot);
        let column_of = |key, columns: &DataColumns, units: &QuantityUnits| {
            axis_columns(columns, units, side, (&kinds, continuous))
                .map_err(|problem| (key, problem))
        };
        let own_position = column_of("data.position", position, &POSITION_UNITS)?;
        let reference = self.reference.as_ref().map(|own| -> Result<AxisColumns, Wrong> {
            let complete = own.with_convention_of(position);
            let columns = column_of("data.reference", &complete, &POSITION_UNITS)?;
            Ok(match own.zero {
                Some(_) => columns,
                None => with_zeros_of(&own_position, columns),
            })
        });
        Ok(Some(Columns {
            side,
            axes: kinds.len(),
            time: self.time.as_ref().map(time_columns).transpose()?,
            torque: column_of("data.torque", torque, &TORQUE_UNITS)?,
            reference: reference.transpose()?,
            position: own_position,
        }))
    }

    fn transmission_side(&self) -> Result<Side, Wrong> {
        let problem =
            "is missing; say whether the signals are of the \"motor\" or the \"joint\" side";
        self.side.ok_or_else(|| ("data.side", problem.into()))
    }

    fn bag_spec(
        &self,
        robot: &Robot,
        named: &[String],
        continuous: &[bool],
    ) -> Result<Option<BagSpec>, Wrong> {
        let Some(BagSection { joints, topic, wraps, effort, time }) = &self.bag else {
            return Ok(None);
        };
        let side = self.transmission_side()?;
        let joints = joints.as_deref().unwrap_or(named);
        if joints.len() != robot.joints() {
            let problem = format!(
                "has {} names for {} axes; give the names in the messages, in the arm's order",
                joints.len(),
                robot.joints()
            );
            return Err(("data.bag.joints", problem));
        }
        if let Some((_, twice)) =
            joints.iter().enumerate().find(|(k, name)| joints[..*k].contains(name))
        {
            return Err((
                "data.bag.joints",
                format!("names `{twice}` twice; name each joint once"),
            ));
        }
        let EffortSection { unit, sign, per_ampere, factor } = effort;
        let torque_unit = TorqueUnit {
            unit,
            sign: sign.as_ref(),
            per_ampere: per_ampere.as_ref(),
            factor: factor.as_ref(),
        };
        let torque_scales = torque_unit
            .axis_scales(&TORQUE_UNITS, side, &kinds(robot))
            .map_err(|problem| ("data.bag.effort", problem))?;
        Ok(Some(BagSpec {
            joints: joints.to_vec(),
            topic: topic.clone(),
            rate_hz: self.rate_hz,
            side,
            torque_scales,
            wraps: wraps_of_each(wraps.as_ref(), side, continuous, robot.joints())
                .map_err(|problem| ("data.bag.wraps", problem))?,
            time: *time,
        }))
    }
}

/// Largest delay of a signal \[µs\].
const MAX_DELAY_US: f64 = 5e5;

/// Returns the delays of a key \[s\]: one for each axis, or none.
pub(super) fn delays_s(
    configured_us: Option<&OneOrEach<f64>>,
    axes: usize,
) -> Result<Vec<f64>, String> {
    let Some(configured_us) = configured_us else { return Ok(Vec::new()) };
    let us = configured_us
        .of_each(axes)
        .ok_or_else(|| format!("has another number of entries than the arm has axes, {axes}"))?;
    match us.iter().find(|us| us.is_nan() || us.abs() > MAX_DELAY_US) {
        Some(us) => Err(format!("is {us}; use -{MAX_DELAY_US} to {MAX_DELAY_US}")),
        None => Ok(us.iter().map(|us| us * 1e-6).collect()),
    }
}

/// Returns for each axis whether its position wraps. By default `continuous` joints do.
fn wraps_of_each(
    wraps: Option<&OneOrEach<bool>>,
    side: Side,
    continuous: &[bool],
    axes: usize,
) -> Result<Vec<bool>, String> {
    let by_default = if side == Side::Joint { continuous.to_vec() } else { Vec::new() };
    let wraps = wraps.map_or(Some(by_default), |wraps| wraps.of_each(axes));
    wraps.ok_or_else(|| wrong_count("wraps", axes))
}

fn kinds(robot: &Robot) -> Vec<JointKind> {
    robot.chain().iter().map(|joint| joint.kind).collect()
}

fn time_columns(time: &TimeColumn) -> Result<TimeColumns, Wrong> {
    let TimeColumn { column, unit, sec, nanosec } = time;
    let (column, unit) = match (column, unit, sec, nanosec) {
        (Some(column), Some(unit), None, None) => (column.text(), unit),
        (None, None, Some(sec), Some(nanosec)) => {
            return Ok(TimeColumns::Parts { sec: sec.text(), nanosec: nanosec.text() });
        }
        _ => {
            let problem = "is one column or two; give `column` and `unit`, or `sec` and `nanosec`";
            return Err(("data.time", problem.to_owned()));
        }
    };
    if unit == DATE_UNIT {
        return Ok(TimeColumns::Dates { column });
    }
    let time_unit = TIME_UNITS.iter().find(|(name, _)| name == unit);
    let (_, second) = time_unit.ok_or_else(|| {
        let problem = format!(
            "has the unit \"{unit}\"; use \"s\", \"ms\", \"us\" or \"ns\", of dates \"{DATE_UNIT}\""
        );
        ("data.time", problem)
    })?;
    Ok(TimeColumns::Numbers { column, second: *second })
}

fn axis_columns(
    columns: &DataColumns,
    units: &QuantityUnits,
    side: Side,
    (kinds, continuous): (&[JointKind], &[bool]),
) -> Result<AxisColumns, String> {
    let axes = kinds.len();
    let list = |names: &Vec<ColumnName>| names.iter().map(ColumnName::text).collect::<Vec<_>>();
    let pattern = columns.column.as_ref().map(ColumnName::text);
    let names = match (pattern, columns.columns.as_ref().map(list)) {
        (Some(_), Some(_)) | (None, None) => {
            return Err("give `column` or `columns`, and not both".to_owned());
        }
        (Some(pattern), None)
            if axes == 1
                || pattern.contains(AXIS_PLACEHOLDER)
                || pattern.contains(INDEX_PLACEHOLDER) =>
        {
            vec![pattern]
        }
        (Some(pattern), None) => {
            return Err(format!(
                "`{pattern}` is one column for {axes} axes; put {AXIS_PLACEHOLDER} (from 1) \
                or {INDEX_PLACEHOLDER} (from 0) in place of the number"
            ));
        }
        (None, Some(names)) if names.len() == axes => names,
        (None, Some(names)) => {
            return Err(format!(
                "`columns` has {} names for {axes} axes; give one for each",
                names.len()
            ));
        }
    };
    let DataColumns { unit, sign, per_ampere, factor, zero, wraps, .. } = columns;
    if wraps.is_some() && units.allows_current {
        return Err("has `wraps`, which belongs to positions; remove it".to_owned());
    }
    let wraps = match units.allows_current {
        true => Vec::new(),
        false => wraps_of_each(wraps.as_ref(), side, continuous, axes)?,
    };
    if zero.is_some() && units.allows_current {
        return Err("has `zero`, which belongs to positions; identify the offset of a torque as \
            `offset` of the friction"
            .to_owned());
    }
    let zeros = zero.as_ref().map_or(Ok(Vec::new()), |zero| numbers(zero, "zero", axes));
    let torque_unit = TorqueUnit {
        unit,
        sign: sign.as_ref(),
        per_ampere: per_ampere.as_ref(),
        factor: factor.as_ref(),
    };
    let scales = torque_unit.axis_scales(units, side, kinds)?;
    Ok(AxisColumns { names, scales, zeros: zeros?, wraps })
}
