//! Methods that simulate the closed loop.

mod alignment;
mod controller_check;
pub(crate) mod didim;
pub(crate) mod idim_iv;
pub(crate) mod inertia;
mod instruments;
mod iteration;
pub(crate) mod output_error;
mod position_noise;
pub(crate) mod simulator;
mod start;
mod validate;
