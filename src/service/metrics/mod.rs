//! The status for Prometheus: a separate process that queries the status socket at every scrape.
//!
//! The service itself opens no network port. The names follow the rules of Prometheus: they contain
//! base units, and end in `_total` if the value only grows. The output is bounded: labels are the
//! program's own causes and the cell's parameters, and at most [`MAX_LABELS`] values per label are
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
