//! The cut-off of the position filter that the data chose, as a table for people.

use didim_identification::identification::{ChosenCutoff, CutoffTrial};

use super::percent_text;
use crate::text::align_table;

/// Formats the trials, and the line for the cell file.
pub fn cutoff_text(chosen: &ChosenCutoff) -> String {
    let rows: Vec<Vec<String>> = chosen
        .trials
        .iter()
        .map(|trial: &CutoffTrial| {
            let is_chosen = trial.cutoff_hz.total_cmp(&chosen.cutoff_hz).is_eq();
            let mark = if is_chosen { "chosen" } else { "" };
            let [held_out, extrapolation] = [trial.held_out, trial.extrapolation].map(percent_text);
            vec![format!("{} Hz", trial.cutoff_hz), held_out, extrapolation, mark.to_owned()]
        })
        .collect();
    format!(
        "{}the lowest cut-off whose held-out error is within 1 % of the smallest; in the cell \
         file:\n\
         position_filter = {{ cutoff_hz = {:?} }}\n",
        align_table(&["position filter", "held-out error", "outside motion", ""], &rows),
        chosen.cutoff_hz
    )
}
