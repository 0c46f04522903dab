//! The mathematics, from outside.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

mod common;

mod closed_loop;
mod corrected_deviation;
mod decimation;
mod didim;
mod dynamics;
mod excitation;
mod feasibility;
mod fence;
mod flexible;
mod gains;
mod identification;
mod output_error;
mod payload;
mod regression;
mod robust;
mod signal;
