//! The output error methods on simulated arms, through the public interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[path = "../identification/arm.rs"]
#[allow(dead_code, reason = "shared with the tests of IDIM-LS, which use more of it")]
mod arm;
mod exact;
mod failures;
#[path = "../didim/looped.rs"]
#[allow(dead_code, reason = "shared with the tests of DIDIM, which use more of it")]
mod looped;
mod loops;
mod sensitivity;
mod variants;
