//! Methods that simulate the closed loop with their estimate, and their common parts.

mod alignment;
mod consistent_parameters;
mod convergence;
mod didim;
mod idim_iv;
mod inertia;
mod instruments;
mod output_error;
mod position_noise;
mod pseudo_linear;
mod simulation_error;
mod simulator;
mod start;
mod validate;

pub(crate) use didim::didim;
pub(crate) use idim_iv::idim_iv;
pub use inertia::mean_joint_inertia;
pub(crate) use output_error::{clie, cloe};
