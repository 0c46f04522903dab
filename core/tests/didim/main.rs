//! DIDIM on simulated arms and on the real recording, through the public interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[path = "../identification/arm.rs"]
#[allow(dead_code, reason = "shared with the tests of IDIM-LS, which use more of it")]
mod arm;
#[path = "../identification/dataset.rs"]
mod dataset;
mod exact;
mod failures;
mod looped;
mod recording;
mod variants;
