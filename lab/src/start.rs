//! Starts beside the nominal parameters.

use didim_core::robot::Robot;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// The robot with each nominal parameter larger or smaller by a part of it, as a seed has it.
pub(super) fn nominal_beside(robot: Robot, part: f64, seed: u64) -> Robot {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let factor = move |_: &str| if random.next_u32() & 1 == 1 { 1.0 + part } else { 1.0 - part };
    robot.with_scaled_nominal(factor)
}
