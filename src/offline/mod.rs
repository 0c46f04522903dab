//! A whole measurement at once: read from a log, identified, every method side by side.

pub mod compare;
pub mod identify;
mod limits;
mod log;
pub mod predict;
mod rate;

pub use limits::{Beyond, BeyondLimits, Cause, Limited, check_limits};
pub use log::{LogError, read_log};
pub use rate::RateError;
