//! What was identified when: a line per result in `history.jsonl`, beside the results.

mod file;
mod follow;
mod line;

pub use file::{HistoryError, read_history};
pub use follow::{HistoryFollower, HistoryMark};
pub use line::{HISTORY_SCHEMA, HistoryLine, ParameterValue};

pub(super) use file::HistoryFile;

/// Lines kept where fewer results are: a year of a result a day and more, so that a trend outlives
/// the results that it is of.
pub(super) const TREND_LINES: usize = 2000;

#[cfg(test)]
mod tests;
