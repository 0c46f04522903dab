//! The load of a whole window, and whether it changed in its midst.

use super::track::{LoadTrack, Look};
use crate::archive::drift::Baseline;
use crate::archive::store::{FoundLoad, LoadChange};
use crate::live::worker::configuration::{Identifier, Refusal};
use crate::live::worker::open::look_samples;
use crate::window::Window;

/// Most parts that a window is looked at in.
const PARTS: usize = 16;

/// What an arm carried along a window; nothing where the configuration looks for no load.
pub(in crate::live::worker) fn load_of_window(
    identifier: &Identifier,
    baseline: &Baseline,
    window: &Window,
) -> Option<Result<FoundLoad, Refusal>> {
    let found = identifier.load(baseline, window)?;
    Some(found.map(|found| FoundLoad { changed: change(identifier, baseline, window), ..found }))
}

/// A part that tells nothing by itself is passed over.
fn change(identifier: &Identifier, baseline: &Baseline, window: &Window) -> Option<LoadChange> {
    let mut looks = parts(window).filter_map(|(after_s, part)| {
        Some((after_s, Look::of(&identifier.load(baseline, &part)?.ok()?)))
    });
    let (_, first) = looks.next()?;
    let mut track = LoadTrack::from(first);
    looks.find_map(|(after_s, look)| {
        let before = track.handle_look(look)?;
        Some(LoadChange { after_s, from_kg: before.mass, to_kg: look.mass })
    })
}

/// Equal parts of what counts, each with the margins of the whole, and when it begins \[s\].
fn parts(window: &Window) -> impl Iterator<Item = (f64, Window)> + '_ {
    let Window { number, sample_rate_hz, samples, counted, end, .. } = window;
    let (before, after) = (counted.start, samples.len() - counted.end);
    let parts = (counted.len() / look_samples(*sample_rate_hz)).clamp(1, PARTS);
    let length = counted.len() / parts;
    (0..parts).map(move |part| {
        let first = part * length;
        #[expect(clippy::cast_precision_loss, reason = "samples of a window")]
        let after_s = first as f64 / sample_rate_hz;
        let part = Window {
            number: *number,
            sample_rate_hz: *sample_rate_hz,
            samples: samples[first..first + before + length + after].to_vec(),
            counted: before..before + length,
            end: *end,
            start: None,
            note: None,
        };
        (after_s, part)
    })
}
