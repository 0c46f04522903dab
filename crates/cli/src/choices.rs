//! Choices that a cell leaves to the data, made before the method runs.

use std::ops::Range;
use std::path::Path;

use didim_identification::identification::{ChosenCutoff, ChosenFriction, Estimate};
use indicatif::ProgressBar;

use super::CliError;
use super::progress::style_bar;
use didim::analysis::identify::{choose_cutoff_from, choose_friction_from};
use didim::analysis::screening::{FRICTION_LAWS_REMEDY, unlisted_laws};
use didim::cell::Cell;
use didim::report;
use didim_formats::Measurement;

/// Values that were chosen from the data. An entry is `None` if the cell configures the value.
pub(super) struct DataChoices {
    cutoff: Option<ChosenCutoff>,
    friction: Option<ChosenFriction>,
    /// Parameters of the chosen friction laws that were not in the cell's list of parameters, if it
    /// has such a list.
    added_parameters: Vec<String>,
}

impl DataChoices {
    /// Chooses the values that the cell leaves to the data, and writes them into the cell.
    pub(super) fn make_choices(
        cell: &mut Cell,
        measurements: &[(&Measurement, Range<usize>)],
        file: &Path,
    ) -> Result<Self, CliError> {
        let mut choices = Self { cutoff: None, friction: None, added_parameters: Vec::new() };
        if cell.chooses_cutoff {
            let bar = trial_counter("cut-offs");
            let chosen = choose_cutoff_from(cell, measurements, || bar.inc(1));
            bar.finish_and_clear();
            let chosen = chosen.map_err(|error| CliError::in_file(file, error))?;
            cell.options.position_filter.cutoff_hz = chosen.cutoff_hz;
            choices.cutoff = Some(chosen);
        }
        // The friction laws are chosen after the cut-off, because their choice uses the filtered
        // motion.
        if cell.chooses_friction {
            let bar = trial_counter("friction laws");
            let chosen = choose_friction_from(cell, measurements, || bar.inc(1));
            bar.finish_and_clear();
            let chosen = chosen.map_err(|error| CliError::in_file(file, error))?;
            let listed = cell.options.parameters.clone().unwrap_or_default();
            let changed = cell.clone().with_friction(chosen.friction.clone());
            *cell = changed.map_err(CliError::from_failure)?;
            let laws = cell.options.parameters.iter().flatten();
            choices.added_parameters =
                laws.filter(|name| !listed.contains(name)).cloned().collect();
            choices.friction = Some(chosen);
        } else if let Some(unlisted) = unlisted_laws(cell) {
            tracing::warn!("{unlisted}; {FRICTION_LAWS_REMEDY}");
        }
        Ok(choices)
    }

    /// Formats each choice that was made, followed by an empty line.
    pub(super) fn text(&self, cell: &Cell) -> String {
        let cutoff = self.cutoff.as_ref().map(report::cutoff::cutoff_text);
        let friction = self.friction.as_ref();
        let friction =
            friction.map(|of| report::friction::friction_text(of, cell, &self.added_parameters));
        cutoff.into_iter().chain(friction).map(|text| text + "\n").collect()
    }

    /// Adds the choices to the estimate, because later uses of the result need them.
    pub(super) fn write_to_cell(&self, estimate: &mut Estimate) {
        if self.friction.is_some() {
            // Notes about friction laws no longer apply, because the friction laws were chosen from
            // the data.
            estimate.verdict.notes.retain(|note| !note.is_about_friction_laws());
        }
        estimate.position_cutoff.clone_from(&self.cutoff);
        estimate.friction.clone_from(&self.friction);
    }
}

/// Creates a counter of trials, which is visible only if stderr is a terminal.
fn trial_counter(what: &str) -> ProgressBar {
    let template = format!("{{spinner}} {what} tried: {{pos}}  {{elapsed}}");
    style_bar(ProgressBar::new_spinner(), &template)
}
