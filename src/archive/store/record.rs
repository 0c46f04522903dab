//! One result with all data needed to reproduce it.

use core::ops::Range;

use didim_formats::RecordingStart;
use didim_identification::identification::Estimate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::against::ModelDifference;
use super::load::FoundLoad;
use super::samples::input_sha256;
use crate::text::sha256;
use crate::window::{DriveReadings, Note, Window, WindowEnd};

/// Content of a result file. It contains neither the computation time nor its date, so that the
/// same input gives the same bytes. It contains the time of the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResultRecord {
    /// Version of the record layout.
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Name of the cell. Empty in results of versions without this key.
    #[serde(default)]
    pub cell: String,
    /// Hash of the cell and robot files as they were read.
    pub configuration: String,
    /// Hash of the window's samples; see [`input_sha256`]. For recordings from files, the SHA-256
    /// over the hashes of the files and the ranges of counted samples.
    pub input_sha256: String,
    /// Window that the result was identified from.
    pub window: WindowProvenance,
    /// The result.
    pub estimate: Estimate,
}

/// Origin of the samples of an estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WindowProvenance {
    /// Number of the window since the start of the stream.
    pub number: u64,
    /// Sequence number of its first sample.
    pub first_sequence: u64,
    /// Sequence number of its last sample.
    pub last_sequence: u64,
    /// Sequence number of the first counted sample.
    pub first_counted: u64,
    /// Number of counted samples.
    pub counted: usize,
    /// Sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Cause of the window's end.
    pub end: WindowEnd,
    /// Time at which the first sample was recorded, from the time stamps of the bus. `None` if the
    /// stamps have no date.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub recorded: Option<RecordingStart>,
    /// Additional drive readings during the counted samples.
    #[serde(flatten)]
    pub readings: DriveReadings,
}

impl WindowProvenance {
    /// Returns the provenance of a window.
    pub fn from_window(window: &Window) -> Self {
        Self {
            number: window.number,
            first_sequence: window.first_sequence(),
            last_sequence: window.last_sequence(),
            first_counted: window
                .samples
                .get(window.counted_samples.start)
                .map_or(0, |sample| sample.sequence),
            counted: window.counted_samples.len(),
            sample_rate_hz: window.sample_rate_hz,
            end: window.end,
            recorded: window.recording_start,
            readings: window.readings(),
        }
    }
}

impl ResultRecord {
    /// Version of the layout.
    pub const SCHEMA: u32 = 2;

    /// Returns the record for subscribers. It omits the data for models and forecasts, which make
    /// up most of the file.
    #[must_use]
    pub fn for_subscribers(&self) -> Self {
        let mut record = self.clone();
        record.estimate.model_uncertainty = None;
        record.estimate.covariance = None;
        record
    }

    /// Creates the record of an estimate from recordings. The window of such a record is all
    /// counted samples together.
    pub fn from_recordings(
        cell: &str,
        configuration: &str,
        recordings: &Recordings<'_>,
        estimate: Estimate,
    ) -> Self {
        let counted: usize =
            recordings.counted_files.iter().map(|(_, counted)| counted.len()).sum();
        Self {
            schema: Self::SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cell: cell.to_owned(),
            configuration: configuration.to_owned(),
            input_sha256: recordings.sha256(),
            window: WindowProvenance {
                number: 0,
                first_sequence: 0,
                last_sequence: (counted as u64).saturating_sub(1),
                first_counted: 0,
                counted,
                sample_rate_hz: recordings.sample_rate_hz,
                end: WindowEnd::EndOfStream,
                recorded: recordings.recorded,
                readings: recordings.readings.clone(),
            },
            estimate,
        }
    }

    /// Creates the record of an estimate from a window.
    pub fn new(cell: &str, configuration: &str, window: &Window, estimate: Estimate) -> Self {
        Self {
            schema: Self::SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cell: cell.to_owned(),
            configuration: configuration.to_owned(),
            input_sha256: input_sha256(window),
            window: WindowProvenance::from_window(window),
            estimate,
        }
    }
}

/// Recordings from files, as the origin of a result.
#[derive(Clone, Debug, Default)]
pub struct Recordings<'a> {
    /// The pieces: the SHA-256 of the file, and the range of the counted samples.
    pub counted_files: Vec<(&'a str, Range<usize>)>,
    /// Sample rate of the first recording \[Hz\].
    pub sample_rate_hz: f64,
    /// Time at which the last recording began, by its own stamps. `None` if they have no date.
    pub recorded: Option<RecordingStart>,
    /// Additional drive readings during the counted samples. Empty for several recordings.
    pub readings: DriveReadings,
}

impl Recordings<'_> {
    /// Returns the SHA-256 over the hashes of the files and the ranges of counted samples.
    fn sha256(&self) -> String {
        let text = |(file, counted): &(&str, Range<usize>)| format!("{file} {counted:?}");
        let parts: Vec<String> = self.counted_files.iter().map(text).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        sha256(&parts)
    }
}

/// Data that is stored with a result in addition to its record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attachments {
    /// Note on the window.
    pub note: Option<Note>,
    /// Hash of the composition of the base parameters.
    pub regrouping: String,
    /// Possible difference from the baseline due to model errors.
    pub against: Option<ModelDifference>,
    /// Payload relative to the baseline.
    pub load: Option<FoundLoad>,
}
