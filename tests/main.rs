//! The service, its documents and its rooms.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

mod common;

mod acquire;
mod arrows;
mod external_torque;
mod fence;
mod manager;
mod memory;
mod operations;
mod paths;
mod readers;
mod robots;
mod service;
mod status;
mod strangers;
mod stream;
