//! Results on disk, and how they drift from the baseline.

pub mod drift;
pub mod store;
