//! Parts that run while the arm moves: the bus thread, the shared memory, the worker and the
//! recorder.

pub mod acquire;
pub mod latency;
mod limits;
pub mod pause;
pub mod recording;
pub mod stream;
pub mod worker;
