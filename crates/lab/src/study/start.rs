//! Starts near the nominal parameters.

use didim_dynamics::robot::Robot;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Returns the robot with each nominal parameter scaled up or down by a fraction of it; the seed
/// determines the direction.
pub(super) fn with_nominal_error(robot: Robot, part: f64, seed: u64) -> Robot {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let factor = move |_: &str| if random.next_u32() & 1 == 1 { 1.0 + part } else { 1.0 - part };
    robot.with_scaled_nominal(factor)
}
