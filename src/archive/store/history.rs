//! The history of identifications, next to the results. `history.jsonl` has a line for each of the
//! newest results. Older lines are in compressed segments, `history-00000000.jsonl.zst`. Results
//! older than two weeks are rows of `history-days.jsonl`, one for each day.

mod day;
mod days;
mod file;
mod follow;
mod line;
mod scan;
mod segments;
mod summary;

pub(crate) use day::day_rows;
pub use day::{MeanPart, WeightedMean};
pub use file::{HistoryError, for_each_day, for_each_line, history_parts, read_history};
pub use follow::{HistoryFollower, HistoryMark};
pub use line::{HISTORY_SCHEMA, HistoryLine, ParameterValue};
pub use summary::{AlarmCheckpoint, AlarmState, DaySummary};

pub(super) use file::{HistoryFile, is_history_file, write_parsed_lines};

/// Number of results that stay in the history with a line of their own, however old they are. It
/// covers more than five years at one result per day.
pub(super) const RECENT_RESULTS: usize = 2000;

#[cfg(test)]
mod tests;
