//! `[data]`: recordings of other programs, for a cell without a bus.

use core::ops::RangeInclusive;

use didim_drivers::layout::TorqueValidity;
use didim_dynamics::SignalTiming;
use didim_dynamics::robot::{JointKind, Robot, TorqueTerm};
use didim_formats::{
    AXIS_PLACEHOLDER, AxisColumns, BagSpec, BagTime, Columns, INDEX_PLACEHOLDER, Side, TimeColumns,
};
use schemars::JsonSchema;
use serde::Deserialize;

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
    /// Commanded positions.
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
    /// `"Nm"`, `"mNm"`; of a prismatic joint `"N"`; `"A"` or `"mA"`, of a current.
    pub unit: OneOrEach<String>,
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
    /// The name of the column.
    ///
    /// If left out: `sec` and `nanosec`.
    #[serde(default)]
    pub column: Option<String>,
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
    pub sec: Option<String>,
    /// The column of the nanoseconds beyond them [ns].
    ///
    /// If left out: `column` and `unit`.
    #[serde(default)]
    pub nanosec: Option<String>,
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
    pub column: Option<String>,
    /// A name for each axis, in the arm's order.
    ///
    /// If left out: `column` names them.
    #[serde(default)]
    pub columns: Option<Vec<String>>,
    /// The unit of the columns. Positions: `"rad"`, `"deg"`; of a prismatic joint `"m"`, `"mm"`.
    /// Torques: `"Nm"`, `"mNm"`; of a prismatic joint `"N"`; of a current `"A"`, `"mA"`.
    pub unit: OneOrEach<String>,
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
}

/// One for all axes, or one for each.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "one for all axes, or a list of one for each")]
pub enum OneOrEach<T> {
    /// For all.
    One(T),
    /// For each.
    Each(Vec<T>),
}

impl<T: Clone> OneOrEach<T> {
    pub(super) fn of_each(&self, axes: usize) -> Option<Vec<T>> {
        match self {
            Self::One(one) => Some(vec![one.clone(); axes]),
            Self::Each(each) => (each.len() == axes).then(|| each.clone()),
        }
    }
}

/// Recordings of other programs, validated.
#[derive(Clone, Debug)]
pub(super) struct RecordingFormat {
    pub(super) rate_hz: f64,
    pub(super) torque_timing: SignalTiming,
    pub(super) columns: Option<Columns>,
    pub(super) bag: Option<BagSpec>,
}

/// Key of an invalid value, and the problem.
type Wrong = (&'static str, String);

/// Range of plausible sample rates.
const RATES_HZ: RangeInclusive<f64> = 1.0..=20_000.0;

/// Units of a quantity.
struct QuantityUnits {
    units: &'static [(&'static str, JointKind, f64)],
    /// True if the quantity may be given as a current.
    allows_current: bool,
}

/// Units of currents, with their size in amperes.
pub(crate) const CURRENT_UNITS: [(&str, f64); 2] = [("A", 1.0), ("mA", 1e-3)];
const POSITION_UNITS: QuantityUnits = QuantityUnits {
    units: &[
        ("rad", JointKind::Revolute, 1.0),
        ("deg", JointKind::Revolute, core::f64::consts::PI / 180.0),
        ("m", JointKind::Prismatic, 1.0),
        ("mm", JointKind::Prismatic, 1e-3),
    ],
    allows_current: false,
};
const TORQUE_UNITS: QuantityUnits = QuantityUnits {
    units: &[
        ("Nm", JointKind::Revolute, 1.0),
        ("mNm", JointKind::Revolute, 1e-3),
        ("N", JointKind::Prismatic, 1.0),
    ],
    allows_current: true,
};
/// Unit that means dates as text.
pub(crate) const DATE_UNIT: &str = "iso8601";
const TIME_UNITS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

impl DataSection {
    /// Returns the sampling, the columns of tables and the joints of bags. `named` are the joint
    /// names of a URDF.
    pub(super) fn read(&self, robot: &Robot, named: &[String]) -> Result<RecordingFormat, Wrong> {
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
        Ok(RecordingFormat {
            rate_hz: self.rate_hz,
            torque_timing: torque_timing.map_err(|problem| ("data.torque_valid", problem))?,
            columns: self.columns(robot)?,
            bag: self.bag_spec(robot, named)?,
        })
    }

    /// Returns the columns for the robot's axes. `None` if the tables have didim's own format.
    fn columns(&self, robot: &Robot) -> Result<Option<Columns>, Wrong> {
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
            axis_columns(columns, units, side, &kinds).map_err(|problem| (key, problem))
        };
        Ok(Some(Columns {
            side,
            axes: kinds.len(),
            time: self.time.as_ref().map(time_columns).transpose()?,
            position: column_of("data.position", position, &POSITION_UNITS)?,
            torque: column_of("data.torque", torque, &TORQUE_UNITS)?,
            reference: (self.reference.as_ref())
                .map(|reference| column_of("data.reference", reference, &POSITION_UNITS))
                .transpose()?,
        }))
    }

    fn transmission_side(&self) -> Result<Side, Wrong> {
        let problem =
            "is missing; say whether the signals are of the \"motor\" or the \"joint\" side";
        self.side.ok_or_else(|| ("data.side", problem.into()))
    }

    fn bag_spec(&self, robot: &Robot, named: &[String]) -> Result<Option<BagSpec>, Wrong> {
        let Some(BagSection { joints, topic, effort, time }) = &self.bag else { return Ok(None) };
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
            time: *time,
        }))
    }
}

fn kinds(robot: &Robot) -> Vec<JointKind> {
    robot.chain().iter().map(|joint| joint.kind).collect()
}

fn time_columns(time: &TimeColumn) -> Result<TimeColumns, Wrong> {
    let TimeColumn { column, unit, sec, nanosec } = time;
    let (column, unit) = match (column, unit, sec, nanosec) {
        (Some(column), Some(unit), None, None) => (column.clone(), unit),
        (None, None, Some(sec), Some(nanosec)) => {
            return Ok(TimeColumns::Parts { sec: sec.clone(), nanosec: nanosec.clone() });
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
    kinds: &[JointKind],
) -> Result<AxisColumns, String> {
    let axes = kinds.len();
    let names = match (&columns.column, &columns.columns) {
        (Some(pattern), None)
            if axes == 1
                || pattern.contains(AXIS_PLACEHOLDER)
                || pattern.contains(INDEX_PLACEHOLDER) =>
        {
            vec![pattern.clone()]
        }
        (Some(pattern), None) => {
            return Err(format!(
                "`{pattern}` is one column for {axes} axes; put {AXIS_PLACEHOLDER} (from 1) \
                or {INDEX_PLACEHOLDER} (from 0) in place of the number"
            ));
        }
        (None, Some(names)) if names.len() == axes => names.clone(),
        (None, Some(names)) => {
            return Err(format!(
                "`columns` has {} names for {axes} axes; give one for each",
                names.len()
            ));
        }
        _ => return Err("give `column` or `columns`, and not both".to_owned()),
    };
    let DataColumns { unit, sign, per_ampere, factor, zero, .. } = columns;
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
    Ok(AxisColumns { names, scales, zeros: zeros?, wraps: Vec::new() })
}

/// Returns the finite numbers of a key, one for each axis.
fn numbers(configured: &OneOrEach<f64>, key: &str, axes: usize) -> Result<Vec<f64>, String> {
    let numbers = configured.of_each(axes).ok_or_else(|| wrong_count(key, axes))?;
    match numbers.iter().find(|number| !number.is_finite()) {
        Some(number) => Err(format!("has a `{key}` of {number}; use a finite number")),
        None => Ok(numbers),
    }
}

/// Returns the problem of a key with another number of entries than axes.
fn wrong_count(key: &str, axes: usize) -> String {
    format!("`{key}` has another number of entries than the arm has axes, {axes}")
}

/// Configured unit, sign and factor of a quantity, and the torque per ampere of a current.
struct TorqueUnit<'a> {
    unit: &'a OneOrEach<String>,
    sign: Option<&'a OneOrEach<f64>>,
    per_ampere: Option<&'a OneOrEach<f64>>,
    factor: Option<&'a OneOrEach<f64>>,
}

impl TorqueUnit<'_> {
    /// Returns the signed SI value of one unit, for each axis.
    fn axis_scales(
        &self,
        units: &QuantityUnits,
        side: Side,
        kinds: &[JointKind],
    ) -> Result<Vec<f64>, String> {
        let axes = kinds.len();
        let each = |what: &str| wrong_count(what, axes);
        let unit = self.unit.of_each(axes).ok_or_else(|| each("unit"))?;
        let signs = self.sign.map_or(Some(vec![1.0; axes]), |signs| signs.of_each(axes));
        let signs = signs.ok_or_else(|| each("sign"))?;
        if let Some(sign) = signs.iter().find(|sign| !matches!(**sign, 1.0 | -1.0)) {
            return Err(format!("has a sign of {sign}; use 1 or -1, and the unit for all else"));
        }
        let amperes =
            |unit: &str| CURRENT_UNITS.iter().find(|(name, _)| *name == unit).map(|of| of.1);
        if self.per_ampere.is_some() && !unit.iter().any(|unit| amperes(unit).is_some()) {
            return Err("has `per_ampere`, which belongs to the units \"A\" and \"mA\"".to_owned());
        }
        let of_each = |of: &OneOrEach<f64>| of.of_each(axes).ok_or_else(|| each("per_ampere"));
        let per_ampere = self.per_ampere.map(of_each).transpose()?;
        let scale = |axis: usize| -> Result<f64, String> {
            // A motor is always revolute, whatever its joint's kind.
            let kind = if side == Side::Motor { JointKind::Revolute } else { kinds[axis] };
            if let Some(amperes) = amperes(&unit[axis]).filter(|_| units.allows_current) {
                let of_one = per_ampere.as_ref().map(|of| of[axis]);
                let fits = of_one.filter(|of| of.is_finite() && *of > 0.0);
                return fits.map(|of_one| amperes * of_one).ok_or_else(|| {
                    format!(
                        "has the unit \"{}\"; give `per_ampere` with it, the torque or force of \
                        one ampere, above 0",
                        unit[axis]
                    )
                });
            }
            let fitting = units.units.iter().filter(|(_, of, _)| *of == kind);
            let scale_found = fitting.clone().find(|(name, ..)| *name == unit[axis]);
            scale_found.map(|(.., scale)| *scale).ok_or_else(|| {
                let currents = CURRENT_UNITS.iter().filter(|_| units.allows_current);
                let names = fitting.map(|(name, ..)| *name).chain(currents.map(|(name, _)| *name));
                let names: Vec<String> = names.map(|name| format!("\"{name}\"")).collect();
                format!(
                    "has the unit \"{}\" for axis {}; use {}",
                    unit[axis],
                    axis + 1,
                    names.join(" or ")
                )
            })
        };
        let factors =
            self.factor.map_or(Ok(vec![1.0; axes]), |factor| numbers(factor, "factor", axes))?;
        if let Some(factor) = factors.iter().find(|factor| **factor <= 0.0) {
            return Err(format!("has a factor of {factor}; use one above 0, and `sign` for signs"));
        }
        (0..axes).map(|axis| Ok(scale(axis)? * signs[axis] * factors[axis])).collect()
    }
}
