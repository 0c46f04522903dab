//! Additional readings of simulated drives: motors that warm up, a constant supply voltage, one
//! mode.

use didim_dynamics::{MAX_JOINTS, Reading};

/// Temperature of the first motor at the start, and temperature step from each motor to the next
/// \[°C\].
const START_C: f64 = 30.0;
const STEP_C: f64 = 1.0;
/// Temperature rise of a motor \[°C\], and its time constant \[s\].
const RISE_C: f64 = 12.0;
const RISE_S: f64 = 600.0;
/// Supply voltage \[V\].
const SUPPLY_V: f64 = 48.0;
/// Mode: cyclic synchronous position (CiA 402).
const POSITION_MODE: f64 = 8.0;

/// Readings of each axis, in the units and the order of [`Reading`].
pub type CycleReadings = [[f64; Reading::ALL.len()]; MAX_JOINTS];

/// Returns the readings of each drive at a time after the start. The readings do not affect the
/// motion, because the simulated friction does not depend on them.
pub(crate) fn readings(time_s: f64) -> CycleReadings {
    let rise_c = RISE_C * (1.0 - (-time_s / RISE_S).exp());
    let mut warmer_c = START_C + rise_c - STEP_C;
    core::array::from_fn(|_| {
        warmer_c += STEP_C;
        [warmer_c, SUPPLY_V, POSITION_MODE, 0.0, 0.0, 0.0, 0.0]
    })
}
