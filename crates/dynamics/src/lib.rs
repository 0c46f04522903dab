//! Rigid-body dynamics of serial arms: description of an arm, its motion, and its closed loop.
//!
//! Contract: pure functions of their arguments. No I/O, no clock, no threads, no async. The only
//! unsafe code calls a function with vector instructions, after asking the processor. The same
//! input gives the same output, bit for bit, on one instruction set. SI units throughout (rad or m,
//! N·m or N, s); names carry a unit wherever a type does not. Nothing here panics on data: every
//! fault is an error with a remedy.
//!
//! Dependencies point one way:
//! `simulation → control → dynamics → trajectory → robot → numeric → sample`.

pub mod control;
pub mod dynamics;
pub mod numeric;
pub mod robot;
pub mod sample;
pub mod simulation;
pub mod trajectory;

pub use sample::{JointSample, MAX_JOINTS, Reading, Readings, SignalTiming, Signals};
