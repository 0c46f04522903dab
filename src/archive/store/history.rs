//! The history of identifications: one line per result in `history.jsonl`, next to the results.

mod file;
mod follow;
mod line;

pub use file::{HistoryError, read_history};
pub use follow::{HistoryFollower, HistoryMark};
pub use line::{HISTORY_SCHEMA, HistoryLine, ParameterValue};

pub(super) use file::HistoryFile;

/// Number of history lines to keep if fewer results are kept. It covers more than a year at one
/// result per day, so that trends include results whose files were removed.
pub(super) const TREND_LINES: usize = 2000;

#[cfg(test)]
mod tests;
