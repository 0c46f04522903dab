//! Signals as they were recorded.

use std::borrow::Cow;

/// Signals as recorded on a uniform grid: one vector per axis, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Samples per second \[Hz\].
    pub sample_rate_hz: f64,
    /// Measured position per axis \[rad\], or \[m\] of a prismatic joint.
    pub position_rad: Vec<Vec<f64>>,
    /// Torque per axis \[N·m\], or force \[N\] of a prismatic joint.
    pub torque_nm: Vec<Vec<f64>>,
    /// Position command of the controller, in the unit of the position, if known.
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
