//! IDIM-LS on simulated motions and on the real recording, through the public interface.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed, and says what it found"
)]

mod checks;
mod cross_validation;
mod exact;
mod noise;
mod recording;
mod refusals;
mod robust;
mod timing;
mod unchecked;
