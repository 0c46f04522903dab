//! Identification of a robot's dynamic parameters, with their uncertainty, from its recorded
//! motion.
//!
//! Contract: pure functions of their arguments. No I/O, no clock, no threads, no async, and no
//! unsafe code. The same input gives the same output, bit for bit, on one instruction set. SI units
//! throughout (rad or m, N·m or N, s); names carry a unit wherever a type does not. Nothing here
//! panics on data: every possible fault is an error with a remedy.
//!
//! Dependencies point one way: `identification → {excitation, feasibility, regression, signal}`.
//! The model of an arm and of its motion comes from `didim_dynamics`.

pub mod excitation;
pub mod feasibility;
pub mod identification;
pub mod regression;
pub mod signal;
