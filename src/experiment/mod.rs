//! Readers and writers of recorded experiments.
//!
//! Whatever the format, a [`Recording`] comes out: signals on a uniform grid, with the side of the
//! transmission they were measured on.

mod csv;
mod log;
mod rate;
mod simulated;

pub use csv::{CsvError, read_csv, write_csv};
pub use log::{LogError, read_log};
pub use rate::RateError;
pub use simulated::{SimulatedError, simulate};
pub(crate) use simulated::{check_fit, check_robot};

use didim_core::identification::Signals;
use didim_core::{JointSample, MAX_JOINTS};
use didim_drivers::layout::{CompiledLayout, CyclesBy};

/// The longest record that is held in memory, from whatever file: 12 minutes at 5 kHz. With six
/// axes and a reference it takes half a gigabyte, and some of it twice while it is filtered.
pub const MAX_SAMPLES: usize = 3_600_000;

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

/// Signals on a uniform grid, and the side of the transmission they belong to.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The side of the transmission.
    pub side: Side,
    /// The signals: one vector per axis, all of one length.
    pub signals: Signals,
    /// Whether nobody compared the stamps with the rate, because the frames count and the stamps do not
    /// ([`CyclesBy::Frames`]).
    pub rate_unchecked: bool,
}

impl Recording {
    /// Motor-side signals of consecutive samples; a reference only when every sample has one. Whatever
    /// is identified from a bus, live or recorded, is made here, so that its rate is checked.
    ///
    /// # Errors
    /// [`RateError`]: the stamps tell another rate than the layout, and they count.
    pub fn from_samples(
        samples: &[JointSample],
        layout: &CompiledLayout,
    ) -> Result<Self, RateError> {
        let (axes, sample_rate_hz) = (layout.axes(), 1e9 / layout.period_ns());
        let rate_unchecked = layout.cycles_by() == CyclesBy::Frames;
        if !rate_unchecked {
            rate::check(samples, sample_rate_hz)?;
        }
        let column = |of: fn(&JointSample) -> &[f64; MAX_JOINTS]| -> Vec<Vec<f64>> {
            (0..axes.min(MAX_JOINTS))
                .map(|axis| samples.iter().map(|sample| of(sample)[axis]).collect())
                .collect()
        };
        let has_reference = !samples.is_empty() && samples.iter().all(|s| s.has_reference);
        Ok(Self {
            side: Side::Motor,
            rate_unchecked,
            signals: Signals {
                sample_rate_hz,
                position_rad: column(|s| &s.motor_position_rad),
                torque_nm: column(|s| &s.motor_torque_nm),
                reference_rad: has_reference.then(|| column(|s| &s.motor_reference_rad)),
            },
        })
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
