//! When a signal is valid.

use serde::{Deserialize, Serialize};

/// When the logged value of a signal acts, relative to the instant of its sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalTiming {
    /// The value acts from the sample's instant for this long \[s\]; 0 means it describes the
    /// instant itself. A torque command that is held until the next sample has one period here.
    #[serde(default)]
    pub hold_s: f64,
    /// Delay of the value after the sample's instant \[s\]; negative if it is valid earlier, as an
    /// old measurement is.
    #[serde(default)]
    pub delay_s: f64,
}

impl SignalTiming {
    /// The signal describes the instant of its sample.
    pub const INSTANTANEOUS: Self = Self { hold_s: 0.0, delay_s: 0.0 };

    /// Returns the mean delay of the logged value \[s\], by which the identification shifts the
    /// signal.
    pub fn mean_delay_s(self) -> f64 {
        self.delay_s + 0.5 * self.hold_s
    }
}
