//! A whole record at once: a log as a measurement, its identification, every method side by side.

pub mod compare;
pub mod identify;
mod log;
mod rate;

pub use log::{LogError, read_log};
pub use rate::RateError;
