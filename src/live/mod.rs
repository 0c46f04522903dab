//! Parts that run while the arm moves: the bus thread, the shared memory, the worker and the
//! recorder. Those that need Linux are compiled for Linux only; their options, and recordings, are
//! read on every system.

#[cfg(target_os = "linux")]
pub mod acquire;
#[cfg(target_os = "linux")]
pub mod external_torque;
pub mod latency;
pub(crate) mod limits;
pub mod pause;
pub mod real_time_options;
pub mod recording;
pub mod stream;
pub mod window_options;
#[cfg(target_os = "linux")]
pub mod worker;
