//! Measured signals of all axes, on one side of the transmission.

use didim_dynamics::Signals;
use didim_dynamics::{JointSample, MAX_JOINTS};
use schemars::JsonSchema;
use serde::Deserialize;

/// Side of the transmission that a measurement describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
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

/// Signals on a uniform grid, and the side of the transmission they belong to.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The side of the transmission.
    pub side: Side,
    /// The signals: one vector per axis, all of one length.
    pub signals: Signals,
    /// True if no times were compared with the rate: the bus layout counts frames, or a bag is read
    /// by its rows.
    pub rate_unchecked: bool,
}

impl Measurement {
    /// Creates a measurement from the motor-side signals of consecutive samples. It has a reference
    /// only if every sample has one.
    pub fn from_samples(samples: &[JointSample], axes: usize, sample_rate_hz: f64) -> Self {
        let column = |of: fn(&JointSample) -> &[f64; MAX_JOINTS]| -> Vec<Vec<f64>> {
            (0..axes.min(MAX_JOINTS))
                .map(|axis| samples.iter().map(|sample| of(sample)[axis]).collect())
                .collect()
        };
        let has_reference = !samples.is_empty() && samples.iter().all(|s| s.has_reference);
        Self {
            side: Side::Motor,
            rate_unchecked: false,
            signals: Signals {
                sample_rate_hz,
                position_rad: column(|s| &s.motor_position_rad),
                torque_nm: column(|s| &s.motor_torque_nm),
                reference_rad: has_reference.then(|| column(|s| &s.motor_reference_rad)),
            },
        }
    }

    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.signals.position_rad.len()
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.signals.position_rad.first().map_or(0, Vec::len)
    }
}
