//! A record: its pieces without gaps, and the changes that were made.

use core::fmt;
use std::collections::BTreeMap;
use std::path::PathBuf;

use didim_dynamics::Readings;

use crate::measurement::Measurement;
use crate::missing_values::MissingValues;
use crate::start::RecordingStart;
use crate::uniform::{Resampled, UniformPiece};

/// Maximum number of listed pieces.
const MAX_LISTED_PIECES: usize = 6;

/// A part of a record without missing samples and without a mode change of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Start time after the first sample of the record \[s\].
    pub begins_s: f64,
    /// Its samples.
    pub measurement: Measurement,
    /// Further readings of the drives, each with the number of its sample; empty unless from frames
    /// of a bus.
    pub readings: Vec<(usize, Readings)>,
}

impl Piece {
    /// Creates a piece without readings.
    pub fn new(begins_s: f64, measurement: Measurement) -> Self {
        Self { begins_s, measurement, readings: Vec::new() }
    }

    /// Returns the time of a sample after the first of the record \[s\].
    pub fn time_s(&self, sample: usize) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
        let sample = sample as f64;
        self.begins_s + sample / self.measurement.signals.sample_rate_hz
    }

    /// Returns the time of its last sample after the first of the record \[s\].
    pub fn ends_s(&self) -> f64 {
        self.time_s(self.measurement.samples().saturating_sub(1))
    }
}

/// A recording, cut where samples are missing and where a drive's mode changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// The pieces in their order; at least one.
    pub segments: Vec<Piece>,
    /// Changes made for a uniform grid.
    pub resampled: Resampled,
    /// Rows left out because they lack a value.
    pub missing_values: Option<MissingValues>,
    /// Recording time of its first sample, if its stamps show it.
    pub recording_start: Option<RecordingStart>,
    /// The file that ends early, because its recorder was killed or it was copied in part.
    pub truncated_file: Option<PathBuf>,
    /// Numbers of frames and bus cycles that are not used, by the key of the cause; empty unless
    /// from frames of a bus.
    pub unused_frames: BTreeMap<&'static str, u64>,
}

impl Record {
    pub(crate) fn from_uniform(
        (parts, resampled): (Vec<UniformPiece>, Resampled),
        measurement: impl Fn(Vec<Vec<f64>>) -> Measurement,
    ) -> Self {
        let piece = |UniformPiece { begins_s, columns }| Piece::new(begins_s, measurement(columns));
        let part_list = parts.into_iter().map(piece).collect();
        Self { resampled, ..Self::from_segments(part_list) }
    }

    /// Creates a record without changes.
    pub fn from_segments(segments: Vec<Piece>) -> Self {
        Self {
            segments,
            resampled: Resampled::default(),
            missing_values: None,
            recording_start: None,
            truncated_file: None,
            unused_frames: BTreeMap::new(),
        }
    }

    pub(crate) fn with_start(self, start: Option<RecordingStart>) -> Self {
        Self { recording_start: start, ..self }
    }

    /// Returns the complete record if nothing is missing.
    pub fn into_whole(mut self) -> Option<Measurement> {
        let last = self.segments.pop();
        last.filter(|_| self.segments.is_empty()).map(|piece| piece.measurement)
    }

    /// Returns notes for the reader, if there are any.
    pub fn notes(&self) -> Vec<String> {
        let missing_values = self.missing_values.as_ref().map(ToString::to_string);
        let resampled = (!self.resampled.is_nothing()).then(|| self.resampled.to_string());
        let cut = (self.segments.len() > 1).then(|| CutTime(&self.segments).to_string());
        let truncated = self.truncated_file.as_ref().map(|file| {
            format!(
                "{} has no end, because its recorder was killed or it was copied in part. It is \
                read up to its last whole chunk; `mcap recover` writes a whole file",
                file.display()
            )
        });
        truncated.into_iter().chain(missing_values).chain(resampled).chain(cut).collect()
    }
}

impl From<Measurement> for Record {
    /// Creates a record of one piece.
    fn from(measurement: Measurement) -> Self {
        Self::from_segments(vec![Piece::new(0.0, measurement)])
    }
}

struct CutTime<'a>(&'a [Piece]);

impl fmt::Display for CutTime<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let listed = self.0.iter().take(MAX_LISTED_PIECES);
        let listed = listed.map(|of| format!("{:.3} to {:.3} s", of.begins_s, of.ends_s()));
        let listed = listed.collect::<Vec<_>>().join(", ");
        let more = if self.0.len() > MAX_LISTED_PIECES { ", …" } else { "" };
        write!(
            f,
            "samples are missing or a drive's mode changes, and the record is cut there; {} whole \
            pieces: {listed}{more}",
            self.0.len()
        )
    }
}
