//! Start parameters that deviate from the nominal parameters.

use didim_dynamics::robot::Robot;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Returns the robot with each nominal parameter multiplied by 1 + `part` or 1 − `part`. The seed
/// determines the sign for each parameter.
pub(super) fn with_nominal_error(robot: Robot, part: f64, seed: u64) -> Robot {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let factor = move |_: &str| if random.next_u32() & 1 == 1 { 1.0 + part } else { 1.0 - part };
    robot.with_scaled_nominal(factor)
}
