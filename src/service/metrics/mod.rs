//! The status for Prometheus: a separate process that queries the status socket at every scrape.
//!
//! The service itself opens no network port. Names follow the rules of Prometheus: base units in
//! the names, and `_total` for values that only grow. The output is bounded. Labels come from the
//! program's own causes and the cell's parameters, and at most [`MAX_LABELS`] of a kind are
//! reported.

mod drift;
mod exposition;
mod families;
mod load;
mod recording;
mod serve;

pub use exposition::MAX_LABELS;
pub use families::metrics_text;
pub use serve::{Limits, ServeError, serve};
