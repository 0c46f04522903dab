//! The status for Prometheus: a process of its own that asks the status socket at every scrape.
//!
//! The service itself opens no network port. Names follow the rules of Prometheus: base units in the
//! names, `_total` for what only grows. What is read is bounded: labels come from the program's own
//! causes and the cell's parameters, and no more than [`MAX_LABELS`] of a kind are told.

mod drift;
mod exposition;
mod families;
mod load;
mod recording;
mod serve;

pub use exposition::MAX_LABELS;
pub use families::exposition;
pub use serve::{Limits, ServeError, serve};
