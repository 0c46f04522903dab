//! From frames to samples, from outside.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

mod common;
mod conformance;
#[path = "../../tests/common/expectation.rs"]
mod expectation;

mod assemble;
mod assemble_period;
mod assemble_random;
mod can_arms;
mod eds;
mod ethercat;
mod layout;
mod mcap;
mod readings;
mod samples;
mod socketcan;
mod sources;
mod text_logs;
mod units;
