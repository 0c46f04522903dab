//! Columns of a table, with their contents and units.

use core::f64::consts::TAU;

use crate::measurement::Side;

/// Placeholder for the number of the axis, from 1, in a column's name.
pub const AXIS_PLACEHOLDER: &str = "{axis}";
/// The same, counted from 0.
pub const INDEX_PLACEHOLDER: &str = "{index}";

/// Measured quantity of each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Positions.
    Position,
    /// Torques or forces.
    Torque,
    /// Commanded positions.
    Reference,
}

impl Quantity {
    pub(crate) const ALL: [Self; 3] = [Self::Position, Self::Torque, Self::Reference];

    pub(crate) fn column_stem(self) -> &'static str {
        match self {
            Self::Position => "position_rad",
            Self::Torque => "torque_nm",
            Self::Reference => "reference_rad",
        }
    }
}

/// Columns of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisColumns {
    /// Their name, with [`AXIS_PLACEHOLDER`] or [`INDEX_PLACEHOLDER`] in place of the number; or
    /// one name for each axis.
    pub names: Vec<String>,
    /// SI value of a 1 in each column, including its sign \[rad, m, N·m or N\]; one per axis.
    pub scales: Vec<f64>,
    /// Value of each column at which the quantity is 0 \[unit of the column\]; empty if all are 0.
    pub zeros: Vec<f64>,
    /// True for each column of angles that wraps at a turn; empty if none does.
    pub wraps: Vec<bool>,
}

/// Place of a row's time in a table.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeColumns {
    /// A column of numbers.
    Numbers {
        /// Its name.
        column: String,
        /// Seconds per unit.
        second: f64,
    },
    /// A column of dates with their time of day (ISO 8601).
    Dates {
        /// Its name.
        column: String,
    },
    /// A stamp in two columns, as in exported logs of ROS.
    Parts {
        /// Whole seconds.
        sec: String,
        /// Whole nanoseconds beyond them.
        nanosec: String,
    },
}

impl TimeColumns {
    fn names(&self) -> impl Iterator<Item = &String> {
        let (first, second) = match self {
            Self::Numbers { column, .. } | Self::Dates { column } => (column, None),
            Self::Parts { sec, nanosec } => (sec, Some(nanosec)),
        };
        [first].into_iter().chain(second)
    }
}

/// Corrections of one quantity, one for each axis; an empty list corrects nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisCorrections {
    /// Factors, including the sign.
    pub scales: Vec<f64>,
    /// Values at which the quantity is 0 \[rad or m\].
    pub zeros: Vec<f64>,
}

/// Corrections of didim's own columns. Those of positions are those of references as well.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OwnColumns {
    /// Positions.
    pub position: AxisCorrections,
    /// Torques or forces.
    pub torque: AxisCorrections,
}

/// Columns that a table may have.
#[derive(Clone, Copy, Debug)]
pub struct TableColumns<'a> {
    /// Those of another program.
    pub configured: Option<&'a Columns>,
    /// Corrections of didim's own.
    pub own: Option<&'a OwnColumns>,
}

impl<'a> From<Option<&'a Columns>> for TableColumns<'a> {
    fn from(configured: Option<&'a Columns>) -> Self {
        Self { configured, own: None }
    }
}

/// Columns of a table that another program wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Side of the transmission.
    pub side: Side,
    /// Number of axes.
    pub axes: usize,
    /// The time, if there is one.
    pub time: Option<TimeColumns>,
    /// Positions.
    pub position: AxisColumns,
    /// Torques or forces.
    pub torque: AxisColumns,
    /// Commanded positions, if they are recorded.
    pub reference: Option<AxisColumns>,
}

impl Columns {
    /// Creates columns with only a time.
    pub fn of_time(time: TimeColumns) -> Self {
        let none = || AxisColumns {
            names: Vec::new(),
            scales: Vec::new(),
            zeros: Vec::new(),
            wraps: Vec::new(),
        };
        Self {
            side: Side::Joint,
            axes: 0,
            time: Some(time),
            position: none(),
            torque: none(),
            reference: None,
        }
    }

    fn axis_columns(&self, quantity: Quantity) -> Option<&AxisColumns> {
        match quantity {
            Quantity::Position => Some(&self.position),
            Quantity::Torque => Some(&self.torque),
            Quantity::Reference => self.reference.as_ref(),
        }
    }

    /// Returns the name of each axis' column.
    pub(crate) fn names(&self, quantity: Quantity) -> Vec<String> {
        let Some(AxisColumns { names, .. }) = self.axis_columns(quantity) else {
            return Vec::new();
        };
        match names.as_slice() {
            [pattern] => (0..self.axes)
                .map(|axis| {
                    let numbered = pattern.replace(AXIS_PLACEHOLDER, &(axis + 1).to_string());
                    numbered.replace(INDEX_PLACEHOLDER, &axis.to_string())
                })
                .collect(),
            names => names.to_vec(),
        }
    }

    /// Returns the names of all columns.
    pub(crate) fn all_names(&self) -> Vec<String> {
        let names = Quantity::ALL.into_iter().flat_map(|quantity| self.names(quantity));
        names.chain(self.time.iter().flat_map(TimeColumns::names).cloned()).collect()
    }

    /// Returns the seconds per unit of the time.
    pub(crate) fn seconds_per_unit(&self) -> f64 {
        match self.time {
            Some(TimeColumns::Numbers { second, .. }) => second,
            _ => 1.0,
        }
    }

    pub(crate) fn zero(&self, quantity: Quantity, axis: usize) -> f64 {
        self.axis_columns(quantity).and_then(|of| of.zeros.get(axis)).copied().unwrap_or(0.0)
    }

    pub(crate) fn is_wrapped(&self, quantity: Quantity, axis: usize) -> bool {
        self.axis_columns(quantity).and_then(|of| of.wraps.get(axis)).copied().unwrap_or(false)
    }

    pub(crate) fn scale(&self, quantity: Quantity, axis: usize) -> f64 {
        self.axis_columns(quantity).and_then(|of| of.scales.get(axis)).copied().unwrap_or(1.0)
    }
}

/// Unwraps angles that wrap at a turn: the first one is within half a turn of 0, and no step is
/// longer than half a turn.
pub fn unwrap_turns(angles_rad: &mut [f64]) {
    let mut before_rad = 0.0;
    for angle in angles_rad.iter_mut().filter(|angle| angle.is_finite()) {
        *angle -= TAU * ((*angle - before_rad) / TAU).round();
        before_rad = *angle;
    }
}
