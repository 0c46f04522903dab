//! Recorded signals: one joint sample, a record of all axes, and when each signal is valid.

mod joint_sample;
mod signal_timing;
mod signals;

pub(crate) use joint_sample::FEW_JOINTS;
pub use joint_sample::{JointSample, MAX_JOINTS, Reading, Readings};
pub use signal_timing::SignalTiming;
pub use signals::Signals;
