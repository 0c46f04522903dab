//! The simulated arm, and what identification makes of it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

mod common;
#[path = "../../tests/common/expectation.rs"]
mod expectation;

mod device;
mod didim;
mod excitation;
mod model_errors;
mod one_error;
mod output_error;
mod recordings;
mod reduction;
mod scenarios;
mod starts;
mod streamed;
mod truth;
mod vcan_device;
mod wrong_statements;
