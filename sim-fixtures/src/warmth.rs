//! What simulated drives tell besides: motors that warm up, a steady supply, one mode.

use didim_core::{MAX_JOINTS, Reading};

/// Temperature of the first motor at the start, and how much warmer each one after it is \[°C\].
const START_C: f64 = 30.0;
const STEP_C: f64 = 1.0;
/// How much warmer a motor becomes \[°C\], and within what time \[s\].
const RISE_C: f64 = 12.0;
const RISE_S: f64 = 600.0;
/// \[V\]
const SUPPLY_V: f64 = 48.0;
/// Cyclic synchronous position (CiA 402).
const MODE: f64 = 8.0;

/// Readings in the units and the order of [`Reading`].
pub type CycleReadings = [[f64; Reading::ALL.len()]; MAX_JOINTS];

/// What each drive tells so long after the start. It moves nothing: the simulated friction does not hang on it.
pub(crate) fn readings(time_s: f64) -> CycleReadings {
    let rise_c = RISE_C * (1.0 - (-time_s / RISE_S).exp());
    let mut warmer_c = START_C + rise_c - STEP_C;
    core::array::from_fn(|_| {
        warmer_c += STEP_C;
        [warmer_c, SUPPLY_V, MODE, 0.0, 0.0, 0.0, 0.0]
    })
}
