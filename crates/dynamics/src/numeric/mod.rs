//! Arithmetic with one source for `f64` and for vector lanes, compiled for the vector instructions
//! of the processor.

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
