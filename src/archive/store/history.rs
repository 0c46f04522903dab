//! The history of identifications: one line per result in `history.jsonl`, next to the results.

mod file;
mod follow;
mod line;

pub use file::{HistoryError, read_history};
pub use follow::{HistoryFollower, HistoryMark};
pub use line::{HISTORY_SCHEMA, HistoryLine, ParameterValue};

pub(super) use file::HistoryFile;

/// Number of kept lines if fewer results are kept: more than a year at one result a day. A trend
/// therefore outlives its results.
pub(super) const TREND_LINES: usize = 2000;

#[cfg(test)]
mod tests;
