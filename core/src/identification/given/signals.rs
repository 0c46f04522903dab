//! Signals as they were recorded.

use std::borrow::Cow;

use nalgebra::DMatrix;

use crate::simulation::Record;

/// Signals as recorded on a uniform grid: one vector per axis, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Samples per second \[Hz\].
    pub sample_rate_hz: f64,
    /// Measured position per axis \[rad\], or \[m\] of a prismatic joint.
    pub position_rad: Vec<Vec<f64>>,
    /// Torque per axis \[N·m\], or force \[N\] of a prismatic joint.
    pub torque_nm: Vec<Vec<f64>>,
    /// What the controller was told to reach, in the unit of the position, when it is known.
    pub reference_rad: Option<Vec<Vec<f64>>>,
}

impl From<Signals> for Cow<'_, Signals> {
    fn from(signals: Signals) -> Self {
        Self::Owned(signals)
    }
}

impl<'a> From<&'a Signals> for Cow<'a, Signals> {
    fn from(signals: &'a Signals) -> Self {
        Self::Borrowed(signals)
    }
}

impl Signals {
    /// What a simulated loop logs on the motor side, its reference included.
    pub fn of_motors(record: &Record) -> Self {
        let columns = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            matrix.column_iter().map(|column| column.iter().copied().collect()).collect()
        };
        Self {
            sample_rate_hz: record.sample_rate_hz,
            position_rad: columns(&record.motor_position_rad),
            torque_nm: columns(&record.motor_torque_nm),
            reference_rad: Some(columns(&record.motor_reference_rad)),
        }
    }
}
