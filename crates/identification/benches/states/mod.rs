//! Random states of a six-axis arm, the same in every benchmark.

use std::array::from_fn;

use didim_dynamics::numeric::{Lanes, WIDTH};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};

/// Axes of the arm.
pub(crate) const N: usize = 6;

/// Position \[rad\], velocity \[rad/s\], acceleration \[rad/s²\], torque \[N·m\].
pub(crate) type State = [[f64; N]; 4];

/// So many states.
pub(crate) fn states(count: usize) -> Vec<State> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let unit = Uniform::new(-1.0, 1.0).unwrap();
    let mut vector = |size: f64| [(); N].map(|()| size * unit.sample(&mut random));
    (0..count).map(|_| [vector(3.0), vector(5.0), vector(20.0), vector(20.0)]).collect()
}

/// States side by side.
pub(crate) const L: usize = WIDTH;

/// The states by groups of so many.
pub(crate) fn in_lanes(states: &[State]) -> Vec<[[Lanes<L>; N]; 4]> {
    let side_by_side = |states: &[State]| {
        from_fn(|what| from_fn(|joint| Lanes::from_fn(|lane| states[lane][what][joint])))
    };
    states.chunks_exact(L).map(side_by_side).collect()
}
