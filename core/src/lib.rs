//! The mathematics of didim: what a serial arm is, how it moves, and what its recorded motion says
//! about its dynamic parameters.
//!
//! Contract: pure functions of their arguments. No I/O, no clock, no threads, no async, and nothing
//! unsafe but the call of a function with vector instructions, after asking the processor. The same
//! input gives the same output, bit for bit, on one instruction set. SI units throughout (rad or m,
//! N·m or N, s); names carry a unit wherever a type does not. Nothing here panics on data: what can
//! be wrong is an error with a remedy.
//!
//! Dependencies point one way: `identification → simulation → {dynamics, control, trajectory,
//! signal, regression} → robot → numeric`, `feasibility → dynamics` and `excitation → {dynamics, trajectory}`.

pub mod control;
pub mod dynamics;
pub mod excitation;
pub mod feasibility;
pub mod identification;
pub mod numeric;
pub mod regression;
pub mod robot;
pub mod sample;
pub mod signal;
pub mod simulation;
pub mod trajectory;

pub use sample::{JointSample, MAX_JOINTS, Reading, Readings};
