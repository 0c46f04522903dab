//! One result with everything needed to reproduce it.

use didim_core::identification::Estimate;
use didim_formats::RecordingStart;
use serde::Serialize;

use super::against::Against;
use super::load::FoundLoad;
use super::samples::input_sha256;
use crate::window::{DriveReadings, Note, Window, WindowEnd};

/// The content of a result file. It holds neither run time nor the date of the computation: the same input gives the
/// same bytes. When that was recorded is a part of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResultRecord {
    /// Version of this record's layout.
    pub schema: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Name of the cell.
    pub cell: String,
    /// Hash of the cell's and the robot's files as they were read.
    pub configuration: String,
    /// Hash of the window's samples; see [`input_sha256`].
    pub input_sha256: String,
    /// What it was identified from.
    pub window: WindowProvenance,
    /// The result.
    pub estimate: Estimate,
}

/// Which samples an estimate comes from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WindowProvenance {
    /// Number of the window since the stream began.
    pub number: u64,
    /// Sequence number of its first sample.
    pub first_sequence: u64,
    /// Sequence number of its last sample.
    pub last_sequence: u64,
    /// Sequence number of the first sample that counts.
    pub first_counted: u64,
    /// Samples that count.
    pub counted: usize,
    /// Sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// What ended the window.
    pub end: WindowEnd,
    /// When its first sample was recorded, by the stamps of the bus; nothing where these have no date.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<RecordingStart>,
    /// What the drives told besides along the samples that count.
    #[serde(flatten)]
    pub readings: DriveReadings,
}

impl WindowProvenance {
    /// That of a window.
    pub fn of(window: &Window) -> Self {
        Self {
            number: window.number,
            first_sequence: window.first_sequence(),
            last_sequence: window.last_sequence(),
            first_counted: window
                .samples
                .get(window.counted.start)
                .map_or(0, |sample| sample.sequence),
            counted: window.counted.len(),
            sample_rate_hz: window.sample_rate_hz,
            end: window.end,
            recorded: window.start,
            readings: window.readings(),
        }
    }
}

impl ResultRecord {
    /// Version of the layout.
    pub const SCHEMA: u32 = 1;

    /// The record for those who listen in, who have no use for what models and forecasts are made of: it is most of the file.
    #[must_use]
    pub fn published(&self) -> Self {
        let mut record = self.clone();
        record.estimate.model_uncertainty = None;
        record.estimate.covariance = None;
        record
    }

    /// The record of an estimate.
    pub fn new(cell: &str, configuration: &str, window: &Window, estimate: Estimate) -> Self {
        Self {
            schema: Self::SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            cell: cell.to_owned(),
            configuration: configuration.to_owned(),
            input_sha256: input_sha256(window),
            window: WindowProvenance::of(window),
            estimate,
        }
    }
}

/// What is stored of a result beside its record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// A report (HTML).
    pub report: Option<String>,
    /// What was noted with its window.
    pub note: Option<Note>,
    /// Hash of how the base parameters are made up.
    pub regrouping: String,
    /// How far the model's errors may set it apart from the baseline.
    pub against: Option<Against>,
    /// What the arm carried, by the baseline.
    pub load: Option<FoundLoad>,
}
