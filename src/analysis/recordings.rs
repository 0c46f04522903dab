//! Identification from recordings, as `didim identify` does it.

use std::borrow::Cow;
use std::ops::Range;

use didim_formats::Measurement;
use didim_identification::identification::{Identification, Method};

use super::choices::DataChoices;
use super::counted::{CountedPiece, measurement_pairs};
use super::identify::{IdentifyError, add_settings, identify_measurements, law_of_commands};
use crate::cell::{Cell, SignalSource};
use crate::window::DriveReadings;

/// Identifies from the samples of recordings that count, by a method and with the choices that
/// were made for the cell. The pieces are moved out of `parts` if `keeps_parts` is false.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_recordings(
    cell: &mut Cell,
    method: Method,
    parts: &mut Vec<CountedPiece>,
    (choices, sources, keeps_parts): (&DataChoices, &[SignalSource], bool),
) -> Result<Identification, IdentifyError> {
    let readings: Vec<DriveReadings> = parts.iter().map(CountedPiece::readings).collect();
    let records = (parts.iter().zip(&readings))
        .map(|(of, readings)| (&of.piece.measurement, &of.counted_range, readings));
    if let Some(law) = law_of_commands(cell, method, records)? {
        cell.options.controller = Some(law);
    }
    let mut identification = match keeps_parts {
        true => identify_measurements(cell, method, borrowed(parts)),
        false => identify_measurements(cell, method, parts.drain(..).map(owned).collect()),
    }?;
    choices.write_to_estimate(&mut identification.estimate);
    add_settings(cell, sources, &mut identification.estimate);
    Ok(identification)
}

fn borrowed(parts: &[CountedPiece]) -> Vec<(Cow<'_, Measurement>, Range<usize>)> {
    let pairs = measurement_pairs(parts).into_iter();
    pairs.map(|(of, counted)| (Cow::Borrowed(of), counted)).collect()
}

fn owned(part: CountedPiece) -> (Cow<'static, Measurement>, Range<usize>) {
    (Cow::Owned(part.piece.measurement), part.counted_range)
}
