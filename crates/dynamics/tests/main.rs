//! Rigid-body dynamics and simulation, from outside.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and prints its figures"
)]

mod closed_loop;
mod dynamics;
mod flexible;
