//! Content of a table's columns, by the names in its header.

use std::path::Path;

use super::column::Column;
use super::error::TableError;
use super::source::Source;
use crate::columns::{AxisColumns, AxisCorrections, Columns, OwnColumns, Quantity, TimeColumns};
use crate::measurement::Side;

/// Content of all columns of a table, in their order.
pub(super) struct Header {
    pub(super) side: Side,
    pub(super) axes: usize,
    pub(super) columns: Vec<Column>,
    pub(super) has_time: bool,
    pub(super) has_reference: bool,
}

impl Header {
    /// Parses the header of a table with didim's own columns; others are refused.
    pub(super) fn parse(source: &dyn Source, path: &Path) -> Result<Self, TableError> {
        let (file, names) = (|| path.to_path_buf(), source.names());
        if !source.has_header() {
            let found = source.first_row_texts().first().cloned().unwrap_or_default();
            return Err(TableError::NoHeader { file: file(), found });
        }
        let mut sides = Vec::new();
        let mut columns = Vec::with_capacity(names.len());
        for name in names {
            let (side, column) = parse_name(name)
                .ok_or_else(|| TableError::UnknownColumn { file: file(), column: name.clone() })?;
            sides.extend(side);
            columns.push(column);
        }
        let side = sides.first().copied().unwrap_or(Side::Motor);
        if sides.iter().any(|s| *s != side) {
            return Err(TableError::MixedSides { file: file() });
        }
        let axes = columns
            .iter()
            .map(|c| if let Column::Signal(_, axis) = c { axis + 1 } else { 0 })
            .max()
            .unwrap_or(0)
            .max(1);
        let count = |wanted: Column| columns.iter().filter(|c| **c == wanted).count();
        let has_reference =
            columns.iter().any(|c| matches!(c, Column::Signal(Quantity::Reference, _)));
        for quantity in Quantity::ALL {
            if quantity == Quantity::Reference && !has_reference {
                continue;
            }
            for axis in 0..axes {
                if count(Column::Signal(quantity, axis)) != 1 {
                    let column = column_name(side, quantity, axis);
                    return Err(TableError::Columns { file: file(), column, axes });
                }
            }
        }
        let times = count(Column::Time);
        if times > 1 {
            return Err(TableError::Columns { file: file(), column: TIME_COLUMN.into(), axes });
        }
        Ok(Self { side, axes, columns, has_time: times == 1, has_reference })
    }
}

impl Header {
    /// Returns didim's own columns as configured ones, with corrections.
    pub(super) fn corrected(&self, corrections: &OwnColumns) -> Columns {
        let Self { side, axes, .. } = *self;
        let axis_columns =
            |quantity, AxisCorrections { scales, zeros }: &AxisCorrections| AxisColumns {
                names: (0..axes).map(|axis| column_name(side, quantity, axis)).collect(),
                scales: scales.clone(),
                zeros: zeros.clone(),
                wraps: Vec::new(),
            };
        let OwnColumns { position, torque } = corrections;
        Columns {
            side,
            axes,
            time: self
                .has_time
                .then(|| TimeColumns::Numbers { column: TIME_COLUMN.to_owned(), second: 1.0 }),
            position: axis_columns(Quantity::Position, position),
            torque: axis_columns(Quantity::Torque, torque),
            reference: self.has_reference.then(|| axis_columns(Quantity::Reference, position)),
        }
    }
}

/// didim's own column of the time.
const TIME_COLUMN: &str = "time_s";
/// Maximum number of names that an error lists.
const MAX_LISTED_NAMES: usize = 24;

impl Header {
    /// Creates the header from the configured columns of another program; other columns are
    /// ignored.
    pub(super) fn of_columns(
        source: &dyn Source,
        wanted: &Columns,
        path: &Path,
    ) -> Result<Self, TableError> {
        let names = source.names();
        let mut columns = vec![Column::Other; names.len()];
        let mut set = |name: &str, column: Column| {
            let index = find_column(source, name, path)?;
            if columns[index] != Column::Other {
                let (file, column) = (path.to_path_buf(), name.to_owned());
                return Err(TableError::AskedTwice { file, column });
            }
            columns[index] = column;
            Ok(())
        };
        match &wanted.time {
            None => {}
            Some(TimeColumns::Numbers { column, .. }) => set(column, Column::Time)?,
            Some(TimeColumns::Dates { column }) => set(column, Column::Date)?,
            Some(TimeColumns::Parts { sec, nanosec }) => {
                set(sec, Column::Seconds)?;
                set(nanosec, Column::Nanoseconds)?;
            }
        }
        for quantity in Quantity::ALL {
            let names_given = wanted.names(quantity);
            if names_given.len() > wanted.axes {
                let column = names_given.last().cloned().unwrap_or_default();
                let (file, axes) = (path.to_path_buf(), wanted.axes);
                return Err(TableError::Columns { file, column, axes });
            }
            for (axis, name) in names_given.into_iter().enumerate() {
                set(&name, Column::Signal(quantity, axis))?;
            }
        }
        Ok(Self {
            side: wanted.side,
            axes: wanted.axes,
            columns,
            has_time: wanted.time.is_some(),
            has_reference: !wanted.names(Quantity::Reference).is_empty(),
        })
    }
}

/// Lists the first names of a table for an error.
pub fn list_names(names: &[String]) -> String {
    let more = if names.len() > MAX_LISTED_NAMES { " …" } else { "" };
    let listed = names.iter().take(MAX_LISTED_NAMES).map(String::as_str);
    listed.collect::<Vec<_>>().join(" ") + more
}

/// Returns the index of a column by its name. A name that no column has may be its number, from 1.
fn find_column(source: &dyn Source, name: &str, path: &Path) -> Result<usize, TableError> {
    let names = source.names();
    let (file, column) = (path.to_path_buf(), name.to_owned());
    let matches = || names.iter().enumerate().filter(|(_, own)| *own == name);
    let mut found = matches().map(|(index, _)| index);
    match (found.next(), found.next()) {
        (Some(index), None) => Ok(index),
        (Some(_), Some(_)) => {
            let numbers: Vec<String> =
                matches().map(|(index, _)| (index + 1).to_string()).collect();
            Err(TableError::DuplicateColumn { file, column, numbers: numbers.join(", ") })
        }
        (None, _) => {
            let number = name.parse().ok().filter(|number| (1..=names.len()).contains(number));
            number.map(|number: usize| number - 1).ok_or_else(|| {
                if !source.has_header() {
                    let found = source.first_row_texts().first().cloned().unwrap_or_default();
                    return TableError::NoHeader { file, found };
                }
                let available = list_names(names);
                TableError::NoSuchColumn { file, column, available }
            })
        }
    }
}

/// Returns the side that didim's own name of a column has. `None` for another name.
pub(super) fn own_side_of_name(name: &str) -> Option<Option<Side>> {
    parse_name(name).map(|(side, _)| side)
}

fn parse_name(name: &str) -> Option<(Option<Side>, Column)> {
    if name == TIME_COLUMN {
        return Some((None, Column::Time));
    }
    let (side, rest) = [Side::Motor, Side::Joint].into_iter().find_map(|side| {
        name.strip_prefix(side.prefix())?.strip_prefix('_').map(|rest| (side, rest))
    })?;
    let (stem, number) = rest.rsplit_once('_')?;
    let quantity = Quantity::ALL.into_iter().find(|q| q.column_stem() == stem)?;
    let axis: usize = number.parse().ok()?;
    let is_axis = (1..=didim_dynamics::MAX_JOINTS).contains(&axis);
    is_axis.then(|| (Some(side), Column::Signal(quantity, axis - 1)))
}

/// Returns the name of didim's own column.
pub(super) fn column_name(side: Side, quantity: Quantity, axis: usize) -> String {
    format!("{}_{}_{}", side.prefix(), quantity.column_stem(), axis + 1)
}
