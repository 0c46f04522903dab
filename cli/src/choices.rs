//! What a cell leaves to the data: chosen before the method runs.

use std::ops::Range;
use std::path::Path;

use didim_core::identification::{ChosenCutoff, ChosenFriction, Estimate};
use indicatif::ProgressBar;

use super::CliError;
use super::progress::styled;
use didim::cell::Cell;
use didim::offline::identify::{choose_cutoff_from, choose_friction_from};
use didim::offline::{LIST_LAWS, unlisted_laws};
use didim::report;
use didim_formats::Measurement;

/// What the data chose; nothing of what the cell states.
pub(super) struct Choices {
    cutoff: Option<ChosenCutoff>,
    friction: Option<ChosenFriction>,
    /// Parameters of the friction laws that were not in the cell's list, if it has one.
    added: Vec<String>,
}

impl Choices {
    /// Chooses what the cell leaves open: the cell has it then.
    pub(super) fn make(
        cell: &mut Cell,
        measurements: &[(&Measurement, Range<usize>)],
        file: &Path,
    ) -> Result<Self, CliError> {
        let mut choices = Self { cutoff: None, friction: None, added: Vec::new() };
        if cell.chooses_cutoff {
            let bar = counting("cut-offs");
            let chosen = choose_cutoff_from(cell, measurements, || bar.inc(1));
            bar.finish_and_clear();
            let chosen = chosen.map_err(|error| CliError::in_file(file, error))?;
            cell.options.position_filter.cutoff_hz = chosen.cutoff_hz;
            choices.cutoff = Some(chosen);
        }
        // With the motion that the filter shows.
        if cell.chooses_friction {
            let bar = counting("friction laws");
            let chosen = choose_friction_from(cell, measurements, || bar.inc(1));
            bar.finish_and_clear();
            let chosen = chosen.map_err(|error| CliError::in_file(file, error))?;
            let stated = cell.options.parameters.clone().unwrap_or_default();
            let changed = cell.clone().with_friction(chosen.friction.clone());
            *cell = changed.map_err(CliError::failed)?;
            let all = cell.options.parameters.iter().flatten();
            choices.added = all.filter(|name| !stated.contains(name)).cloned().collect();
            choices.friction = Some(chosen);
        } else if let Some(unlisted) = unlisted_laws(cell) {
            tracing::warn!("{unlisted}; {LIST_LAWS}");
        }
        Ok(choices)
    }

    /// For people: each choice that the cell has now, and an empty line.
    pub(super) fn text(&self, cell: &Cell) -> String {
        let cutoff = self.cutoff.as_ref().map(report::cutoff::choice);
        let friction = self.friction.as_ref();
        let friction = friction.map(|of| report::friction::choice(of, cell, &self.added));
        cutoff.into_iter().chain(friction).map(|text| text + "\n").collect()
    }

    /// Puts them into the result, which needs them to be used.
    pub(super) fn note_in(&self, estimate: &mut Estimate) {
        if self.friction.is_some() {
            // Its advice was followed.
            estimate.verdict.notes.retain(|note| !note.is_about_friction_laws());
        }
        estimate.position_cutoff.clone_from(&self.cutoff);
        estimate.friction.clone_from(&self.friction);
    }
}

/// Counts what is tried, on stderr where it is a terminal.
fn counting(what: &str) -> ProgressBar {
    let template = format!("{{spinner}} {what} tried: {{pos}}  {{elapsed}}");
    styled(ProgressBar::new_spinner(), &template)
}
