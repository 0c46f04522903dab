//! The output error methods, and instruments of the simulated motion, on simulated arms.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed, and says what it found"
)]

mod exact;
mod failures;
mod figures;
mod held_out;
mod instruments;
mod loops;
mod robust;
mod sensitivity;
mod variants;
