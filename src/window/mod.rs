//! The samples that one result comes from, with what a person noted of them.

mod note;
mod readings;

use core::ops::Range;

use didim_core::JointSample;
use didim_formats::RecordingStart;
use serde::{Deserialize, Serialize};

pub use note::{Note, NoteError};
pub use readings::{DriveReadings, JointMode, JointReading};

/// What ended a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WindowEnd {
    /// The arm came to rest.
    Rest,
    /// The interval was over.
    Interval,
    /// A command.
    Command,
    /// It reached its greatest length.
    Length,
    /// A drive changed its mode.
    ModeChange,
    /// The log ended.
    EndOfStream,
}

/// A window without loss: consecutive samples of the uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Windows opened before this one since the stream began.
    pub number: u64,
    /// Sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// The samples, margins included; their sequence numbers have no gap.
    pub samples: Vec<JointSample>,
    /// Those that count; the rest is margin for the edges of the filters.
    pub counted: Range<usize>,
    /// What ended it.
    pub end: WindowEnd,
    /// When its first sample was recorded, where that is known.
    pub start: Option<RecordingStart>,
    /// What was noted with it.
    pub note: Option<Note>,
}

impl Window {
    /// Sequence number of the first sample.
    pub fn first_sequence(&self) -> u64 {
        self.samples.first().map_or(0, |sample| sample.sequence)
    }

    /// What the drives told besides along the samples that count.
    pub fn readings(&self) -> DriveReadings {
        let counted = self.samples.get(self.counted.clone()).unwrap_or_default();
        DriveReadings::of(counted.iter().map(|sample| &sample.readings))
    }

    /// Sequence number of the last sample.
    pub fn last_sequence(&self) -> u64 {
        self.samples.last().map_or(0, |sample| sample.sequence)
    }
}
