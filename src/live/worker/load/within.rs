//! The load during a complete window, and load changes within it.

use super::track::{LoadTrack, Survey};
use crate::archive::drift::Baseline;
use crate::archive::store::{FoundLoad, LoadChange};
use crate::live::worker::configuration::{Identifier, Refusal};
use crate::live::worker::open::look_samples;
use crate::window::Window;

/// Maximum number of parts into which a window is split.
const MAX_PARTS: usize = 16;

/// Identifies the payload of an arm during a window. `None` if the configuration does not identify
/// loads.
pub(in crate::live::worker) fn load_of_window(
    identifier: &Identifier,
    baseline: &Baseline,
    window: &Window,
) -> Option<Result<FoundLoad, Refusal>> {
    let outcome = identifier.load(baseline, window)?;
    Some(
        outcome
            .map(|found| FoundLoad { changed: find_change(identifier, baseline, window), ..found }),
    )
}

/// Finds a load change within a window. Skips parts of the window from which the load is not
/// identifiable.
fn find_change(
    identifier: &Identifier,
    baseline: &Baseline,
    window: &Window,
) -> Option<LoadChange> {
    let mut looks = split_window(window).filter_map(|(after_s, part)| {
        Some((after_s, Survey::from_load(&identifier.load(baseline, &part)?.ok()?)))
    });
    let (_, first) = looks.next()?;
    let mut track = LoadTrack::from(first);
    looks.find_map(|(after_s, survey)| {
        let before = track.handle_look(survey)?;
        Some(LoadChange { after_s, from_kg: before.mass, to_kg: survey.mass })
    })
}

/// Splits the counted samples into equal parts. Returns each part as a window with the margins of
/// the complete one, and its start time \[s\].
fn split_window(window: &Window) -> impl Iterator<Item = (f64, Window)> + '_ {
    let Window { number, sample_rate_hz, samples, counted_samples: counted, end, .. } = window;
    let (before, after) = (counted.start, samples.len() - counted.end);
    let parts = (counted.len() / look_samples(*sample_rate_hz)).clamp(1, MAX_PARTS);
    let length = counted.len() / parts;
    (0..parts).map(move |part| {
        let first = part * length;
        #[expect(clippy::cast_precision_loss, reason = "samples of a window")]
        let after_s = first as f64 / sample_rate_hz;
        let part = Window {
            number: *number,
            sample_rate_hz: *sample_rate_hz,
            samples: samples[first..first + before + length + after].to_vec(),
            counted_samples: before..before + length,
            end: *end,
            recording_start: None,
            note: None,
        };
        (after_s, part)
    })
}
