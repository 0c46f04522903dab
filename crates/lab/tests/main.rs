//! Recordings of the simulated arm, corrupted in every way that a plant can, and their results.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

mod faults;
#[path = "../../../src/seeds.rs"]
mod seeds;
#[allow(dead_code, reason = "not all of it is wanted here")]
#[path = "../../../sim-fixtures/tests/common/table.rs"]
mod table;
