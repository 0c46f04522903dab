//! The output error methods, and instruments of the simulated motion, on simulated arms.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed, and says what it found"
)]

#[path = "../identification/arm.rs"]
#[allow(dead_code, reason = "shared with the tests of IDIM-LS, which use more of it")]
mod arm;
mod exact;
mod failures;
mod figures;
mod held_out;
mod instruments;
#[path = "../didim/looped.rs"]
#[allow(dead_code, reason = "shared with the tests of DIDIM, which use more of it")]
mod looped;
mod loops;
mod robust;
mod sensitivity;
mod variants;
