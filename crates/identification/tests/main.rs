//! The mathematics, from outside.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

#[path = "../../dynamics/tests/dynamics/arms.rs"]
#[allow(dead_code, reason = "each test program uses a part of it")]
mod arms;
mod common;

mod corrected_deviation;
mod decimation;
mod didim;
mod excitation;
mod external_torque;
mod feasibility;
mod gains;
mod identification;
mod output_error;
mod payload;
mod regression;
mod robust;
mod signal;
