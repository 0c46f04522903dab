//! What was recorded, and when each signal was valid.

use core::ops::Range;

use nalgebra::DMatrix;

/// When the logged value of a signal acts, relative to the instant of its sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SignalTiming {
    /// The value acts from the sample's instant for this long \[s\]; 0 means it describes the
    /// instant itself. A torque command that is held until the next sample has one period here.
    pub hold_s: f64,
    /// The value acts this much later than the sample's instant \[s\].
    pub delay_s: f64,
}

impl SignalTiming {
    /// The signal describes the instant of its sample.
    pub const INSTANT: Self = Self { hold_s: 0.0, delay_s: 0.0 };

    /// The mean age of the logged value \[s\]: what the identification has to shift the signal by.
    pub fn mean_delay_s(self) -> f64 {
        self.delay_s + 0.5 * self.hold_s
    }
}

/// Joint-side signals of one window on a uniform grid: one row per sample, one column per joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    sample_rate_hz: f64,
    position_rad: DMatrix<f64>,
    torque_nm: DMatrix<f64>,
    reference_rad: Option<DMatrix<f64>>,
    torque_timing: SignalTiming,
    counted: Range<usize>,
}
