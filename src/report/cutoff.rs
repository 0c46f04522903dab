//! The cut-off of the position filter that the data chose, as a table for people.

use didim_core::identification::{ChosenCutoff, CutoffTrial};

use super::percent;
use crate::text::aligned;

/// What was tried, and the line for the cell file.
pub fn choice(chosen: &ChosenCutoff) -> String {
    let row = |trial: &CutoffTrial| {
        let is_chosen = trial.cutoff_hz.total_cmp(&chosen.cutoff_hz).is_eq();
        let mark = if is_chosen { "chosen" } else { "" };
        let [held_out, elsewhere] = [trial.held_out, trial.elsewhere].map(percent);
        vec![format!("{} Hz", trial.cutoff_hz), held_out, elsewhere, mark.to_owned()]
    };
    let rows: Vec<Vec<String>> = chosen.trials.iter().map(row).collect();
    format!(
        "{}the lowest cut-off whose held-out error is within 1 % of the smallest; in the cell file:\n\
         position_filter = {{ cutoff_hz = {:?} }}\n",
        aligned(&["position filter", "held-out error", "elsewhere", ""], &rows),
        chosen.cutoff_hz
    )
}
