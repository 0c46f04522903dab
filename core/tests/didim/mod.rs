//! DIDIM on simulated arms and on the real recording, through the public interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod exact;
mod failures;
mod recording;
mod variants;
