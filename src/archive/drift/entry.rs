//! A result of the history with its comparison.

use super::{Change, Comparison, NotComparable};
use crate::archive::store::HistoryLine;

/// One result of the history, judged with the data available at its time.
#[derive(Clone, Debug)]
pub struct Entry {
    /// History line of the result.
    pub line: HistoryLine,
    /// Comparison with the baseline. `None` for the baseline itself, for results before it, and
    /// without a baseline.
    pub comparison: Option<Result<Comparison, NotComparable>>,
    /// Parameters whose alarms were raised after this result.
    pub alarmed_parameters: Vec<String>,
}

impl Entry {
    /// Returns the change with the largest share of its band.
    pub fn largest_change(&self) -> Option<&Change> {
        let changes = &self.comparison.as_ref()?.as_ref().ok()?.changes;
        let judged = changes.iter().filter(|change| !change.band_share().is_nan());
        judged.max_by(|a, b| a.band_share().total_cmp(&b.band_share()))
    }
}
