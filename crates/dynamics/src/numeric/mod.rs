//! Numbers side by side: one source for `f64` and for lanes of vector registers, compiled for the
//! vector instructions that the processor has.

mod dispatch;
mod elementary;
mod lanes;
mod median;
mod scalar;

pub use dispatch::WIDTH;
pub use dispatch::{from_lanes, with_vector_instructions};
pub use lanes::Lanes;
pub use median::median;
pub use scalar::Scalar;
