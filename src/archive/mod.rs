//! Results on disk, how they drift from the baseline, and how arms of one type stand to each other.

pub mod drift;
pub mod fleet;
pub mod store;
