//! Random numbers determined by a seed.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardUniform};

/// Returns a uniformly distributed number from −1 to 1.
pub(super) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    let unit: f64 = StandardUniform.sample(random);
    2.0 * unit - 1.0
}
