//! DIDIM on simulated arms and on the real recording, through the public interface.

mod exact;
mod failures;
mod recording;
mod variants;
