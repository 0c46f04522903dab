//! The samples that one result comes from, with the notes of a person.

mod note;
mod note_limits;
mod readings;

use core::ops::Range;

use didim_dynamics::JointSample;
use didim_formats::RecordingStart;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use note::{Note, NoteError};
pub use readings::{DriveReadings, JointMode, JointReading};

/// Reason for the end of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WindowEnd {
    /// The arm came to rest.
    Rest,
    /// The interval ended.
    Interval,
    /// A command closed the window.
    Command,
    /// The window reached its maximum length.
    Length,
    /// A drive changed its mode.
    ModeChange,
    /// The log ended.
    EndOfStream,
}

/// A window without losses. Its samples are consecutive samples of the uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Number of windows opened before this one since the stream began.
    pub number: u64,
    /// Sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Samples including margins. Their sequence numbers have no gap.
    pub samples: Vec<JointSample>,
    /// Range of the counted samples. The other samples are margin for the edges of the filters.
    pub counted_samples: Range<usize>,
    /// Reason for the end of the window.
    pub end: WindowEnd,
    /// Time at which the first sample was recorded, if known.
    pub recording_start: Option<RecordingStart>,
    /// Note on the window.
    pub note: Option<Note>,
}

impl Window {
    /// Returns the sequence number of the first sample.
    pub fn first_sequence(&self) -> u64 {
        self.samples.first().map_or(0, |sample| sample.sequence)
    }

    /// Returns the additional drive readings along the counted samples.
    pub fn readings(&self) -> DriveReadings {
        let counted = self.samples.get(self.counted_samples.clone()).unwrap_or_default();
        DriveReadings::from_cycles(counted.iter().map(|sample| &sample.readings))
    }

    /// Returns the sequence number of the last sample.
    pub fn last_sequence(&self) -> u64 {
        self.samples.last().map_or(0, |sample| sample.sequence)
    }
}
