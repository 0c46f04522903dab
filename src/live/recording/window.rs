//! Data about the window in the recording of a result. With them, a replay gives the same result.
//!
//! A replay starts without earlier frames. It does not know the numbers of earlier cycles and
//! windows, nor the events that opened and closed the window, so the metadata contain these. All
//! other inputs of a result are in the frames, the cell and the program. Positions of multi-turn
//! encoders are reduced to the encoder's range, and so do not depend on earlier frames. The frames
//! before the window in the recording determine the state of the cycle grid.

use std::collections::BTreeMap;
use std::path::Path;

use didim_drivers::assemble::Assembler;
use didim_drivers::samples::Samples;
use didim_drivers::source::{McapSource, SourceError};
use didim_formats::RecordingStart;

use super::input::{is_mcap, open_log};
use crate::window::{Window, WindowEnd};

/// Number of frames read from the recording at a time.
const BATCH_FRAMES: usize = 256;

/// A window, as described in its recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedWindow {
    /// Number of windows opened before this one since the start of the stream.
    pub number: u64,
    /// Sequence number of the first sample.
    pub first_sequence: u64,
    /// Stamp of the first sample \[ns\].
    pub first_stamp_ns: u64,
    /// Stamp of the last sample \[ns\].
    pub last_stamp_ns: u64,
    /// Number of samples including margins.
    pub samples: usize,
    /// Reason for the end of the window.
    pub end: WindowEnd,
    /// Time at which the first sample was recorded, as stated in the result. `None` if unknown.
    pub start: Option<RecordingStart>,
    /// Hash of the configuration used for its identification. `None` if the recording does not
    /// contain it.
    pub configuration: Option<String>,
}

const NUMBER_KEY: &str = "window";
const FIRST_SEQUENCE_KEY: &str = "window_first_sequence";
const FIRST_STAMP_KEY: &str = "window_first_stamp_ns";
const LAST_STAMP_KEY: &str = "window_last_stamp_ns";
const SAMPLES_KEY: &str = "window_samples";
const END_KEY: &str = "window_end";
const START_KEY: &str = "window_recorded";
const CONFIGURATION_KEY: &str = "window_configuration";

impl RecordedWindow {
    /// Creates the description of a window. `configuration` is the hash of the configuration that
    /// identifies it.
    pub fn new(window: &Window, configuration: &str) -> Self {
        let stamp = |sample: Option<&didim_dynamics::JointSample>| sample.map_or(0, |s| s.stamp_ns);
        Self {
            number: window.number,
            first_sequence: window.first_sequence(),
            first_stamp_ns: stamp(window.samples.first()),
            last_stamp_ns: stamp(window.samples.last()),
            samples: window.samples.len(),
            end: window.end,
            start: window.recording_start,
            configuration: Some(configuration.to_owned()),
        }
    }

    /// Converts the description to the metadata of a recording.
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let end = serde_json::to_value(self.end).ok();
        let end = end.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default().to_owned();
        let fields = [
            (NUMBER_KEY, self.number.to_string()),
            (FIRST_SEQUENCE_KEY, self.first_sequence.to_string()),
            (FIRST_STAMP_KEY, self.first_stamp_ns.to_string()),
            (LAST_STAMP_KEY, self.last_stamp_ns.to_string()),
            (SAMPLES_KEY, self.samples.to_string()),
            (END_KEY, end),
        ];
        let configuration = self.configuration.clone().map(|hash| (CONFIGURATION_KEY, hash));
        let start = self.start.map(|start| (START_KEY, start.to_string()));
        let fields = fields.into_iter().chain(start).chain(configuration);
        fields.map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// Parses the metadata. `None` if they do not describe a window.
    pub fn from_map(map: &BTreeMap<String, String>) -> Option<Self> {
        let number = |key: &str| map.get(key)?.parse::<u64>().ok();
        let end = serde_json::Value::String(map.get(END_KEY)?.clone());
        Some(Self {
            number: number(NUMBER_KEY)?,
            first_sequence: number(FIRST_SEQUENCE_KEY)?,
            first_stamp_ns: number(FIRST_STAMP_KEY)?,
            last_stamp_ns: number(LAST_STAMP_KEY)?,
            samples: usize::try_from(number(SAMPLES_KEY)?).ok()?,
            end: serde_json::from_value(end).ok()?,
            start: map.get(START_KEY).and_then(|start| start.parse().ok()),
            configuration: map.get(CONFIGURATION_KEY).cloned(),
        })
    }

    /// Reads the window from a recording. `None` if the recording is not that of a window.
    ///
    /// # Errors
    /// [`SourceError`]: the recording cannot be read.
    pub fn of_file(path: &Path) -> Result<Option<Self>, SourceError> {
        if !is_mcap(path) {
            return Ok(None);
        }
        let source = McapSource::open(path, &[])?;
        let Some(info) = source.info() else { return Ok(None) };
        Ok(Self::from_map(&info.additional_entries).map(|window| {
            // The configuration in the recorder's metadata is older if the configuration was
            // reloaded since.
            let configuration = window.configuration.or_else(|| Some(info.configuration.clone()));
            Self { configuration, ..window }
        }))
    }

    /// Returns true if the window was identified with this configuration (its hash), or if its
    /// configuration is unknown.
    pub fn is_of(&self, configuration: &str) -> bool {
        self.configuration.as_ref().is_none_or(|recorded| recorded == configuration)
    }

    /// Returns the sequence number of the first cycle of the recording. `None` if the frames do not
    /// give the first sample of the window, because frames are missing or `assembler` belongs to
    /// another cell.
    ///
    /// # Errors
    /// [`SourceError`]: the recording cannot be read.
    pub fn sequence_at_start(
        &self,
        path: &Path,
        assembler: Assembler,
    ) -> Result<Option<u64>, SourceError> {
        let source = open_log(path, Some(assembler.layout()), &[])?;
        for sample in Samples::new(source, assembler, BATCH_FRAMES) {
            let sample = sample?;
            if sample.stamp_ns == self.first_stamp_ns {
                return Ok(self.first_sequence.checked_sub(sample.sequence));
            }
        }
        Ok(None)
    }
}
