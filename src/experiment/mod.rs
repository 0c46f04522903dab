//! Readers and writers of recorded experiments.
//!
//! Whatever the format, a [`Recording`] comes out: signals on a uniform grid, with the side of the
//! transmission they were measured on.

mod csv;

pub use csv::{CsvError, read_csv, write_csv};

/// Which side of the transmission a recording describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Motor angles and motor torques, as a drive reports them.
    Motor,
    /// Joint angles (or lengths) and joint torques (or forces).
    Joint,
}

impl Side {
    /// The prefix of this side's columns in a CSV file.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Joint => "joint",
        }
    }
}

/// Signals on a uniform grid: one vector per axis, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The side of the transmission.
    pub side: Side,
    /// Samples per second \[Hz\].
    pub sample_rate_hz: f64,
    /// Measured position per axis \[rad\] (joint side of a prismatic joint: \[m\]).
    pub position: Vec<Vec<f64>>,
    /// Torque per axis \[N·m\] (joint side of a prismatic joint: \[N\]).
    pub torque: Vec<Vec<f64>>,
    /// What the controller was told to reach, in the unit of the position, if it was recorded.
    pub reference: Option<Vec<Vec<f64>>>,
}

impl Recording {
    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.position.len()
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.position.first().map_or(0, Vec::len)
    }
}
