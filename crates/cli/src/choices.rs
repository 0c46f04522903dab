//! Choices that a cell leaves to the data, with their progress and their text.

use std::ops::Range;
use std::path::Path;

use indicatif::ProgressBar;

use super::CliError;
use super::progress::style_bar;
use didim::analysis::screening::{FRICTION_LAWS_REMEDY, unlisted_laws};
use didim::analysis::{Choice, ChoiceError, DataChoices};
use didim::cell::Cell;
use didim::report;
use didim_formats::Measurement;

/// Chooses the values that the cell leaves to the data, and writes them into the cell. The number
/// of trials is visible only if stderr is a terminal.
pub(super) fn make_choices(
    cell: &mut Cell,
    measurements: &[(&Measurement, Range<usize>)],
    file: &Path,
) -> Result<DataChoices, CliError> {
    let bars = [Choice::Cutoff, Choice::Friction].map(|choice| (choice, trial_counter(choice)));
    let tried = |choice| {
        bars.iter().filter(|(of, _)| *of == choice).for_each(|(_, bar)| bar.inc(1));
    };
    let choices = DataChoices::make_choices(cell, measurements, tried);
    bars.iter().for_each(|(_, bar)| bar.finish_and_clear());
    let choices = choices.map_err(|error| match error {
        ChoiceError::Identify(error) => CliError::in_file(file, error),
        error @ ChoiceError::BaseParameters(_) => CliError::from_failure(error),
    })?;
    if choices.friction.is_none()
        && let Some(unlisted) = unlisted_laws(cell)
    {
        tracing::warn!("{unlisted}; {FRICTION_LAWS_REMEDY}");
    }
    Ok(choices)
}

/// Formats each choice that was made, followed by an empty line.
pub(super) fn choices_text(choices: &DataChoices, cell: &Cell) -> String {
    let cutoff = choices.cutoff.as_ref().map(report::cutoff::cutoff_text);
    let friction = choices.friction.as_ref();
    let friction =
        friction.map(|of| report::friction::friction_text(of, cell, &choices.added_parameters));
    cutoff.into_iter().chain(friction).map(|text| text + "\n").collect()
}

/// Creates the counter of a choice's trials.
fn trial_counter(choice: Choice) -> ProgressBar {
    let name = match choice {
        Choice::Cutoff => "cut-offs",
        Choice::Friction => "friction laws",
    };
    let template = format!("{{spinner}} {name} tried: {{pos}}  {{elapsed}}");
    style_bar(ProgressBar::new_spinner(), &template)
}
