//! The rows of a table file.

use std::path::Path;

use didim_dynamics::Signals;

use super::error::TableError;
use super::grid::{Grid, find_grid};
use super::place::RowPlace;
use crate::measurement::{Measurement, Side};
use crate::missing_values::{CompleteRows, DisjointColumns, MissingValues};
use crate::start::RecordingStart;

/// The rows of a table file, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub(super) side: Side,
    pub(super) axes: usize,
    pub(super) first_row: RowPlace,
    /// Time of each row since the first row \[s\], if the table has times.
    pub time: Option<Vec<f64>>,
    /// Value of the last digit of the finest time \[s\].
    pub(super) resolution_s: f64,
    /// Seconds per unit of the time column.
    pub(super) second: f64,
    /// Instant of the first time \[ns after 1970\], if it is known.
    pub(super) first_ns: Option<i128>,
    /// Positions, torques and references by axis; the references may be empty.
    pub signals: [Vec<Vec<f64>>; 3],
    /// Rows at which another recording is known to begin.
    pub(super) begins: Vec<usize>,
    /// The rows that lack a value and were left out, if any.
    pub(super) incomplete_rows: Option<IncompleteRows>,
}

/// Rows with missing values, and the remaining rows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct IncompleteRows {
    /// The complete rows.
    pub(super) complete_rows: CompleteRows,
    pub(super) missing_values: MissingValues,
    pub(super) disjoint_columns: Box<DisjointColumns>,
}

impl Table {
    pub(super) fn grid(&self, declared: Option<f64>, path: &Path) -> Result<Grid, TableError> {
        find_grid(self.time.as_deref(), self.first_row, declared, path)
    }

    /// Returns the recording time of its first row.
    pub(super) fn start(&self) -> Option<RecordingStart> {
        let after_s = *self.time.as_ref()?.first()?;
        #[expect(clippy::cast_possible_truncation, reason = "saturates, and is no date then")]
        let after_ns = (1e9 * after_s).round() as i128;
        RecordingStart::of_unix_ns(self.first_ns?.saturating_add(after_ns))
    }

    pub(super) fn into_measurement(self, sample_rate_hz: f64) -> Measurement {
        let [position_rad, torque_nm, reference] = self.signals;
        let reference_rad = (!reference.is_empty()).then_some(reference);
        let signals = Signals { sample_rate_hz, position_rad, torque_nm, reference_rad };
        Measurement { side: self.side, rate_unchecked: false, signals }
    }
}
