//! Results on disk, their drift from the baseline, and the comparison of arms of one type.

pub mod drift;
pub mod events;
pub mod fleet;
mod results;
mod skipped_lines;
pub mod store;

pub use results::{ResultOptions, Results, drift_of_result};
