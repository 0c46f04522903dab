//! What a recording of a result says about its window, so that a replay gives the same result.
//!
//! A fresh start knows neither how many cycles and windows there were before, nor what opened and
//! closed this one. All else that decides a result is in the frames, the cell and the program: the
//! positions of turning encoders are taken within their range without memory, and what the grid of
//! cycles remembers is in the frames kept before the window.

use std::collections::BTreeMap;
use std::path::Path;

use didim_drivers::assemble::Assembler;
use didim_drivers::samples::Samples;
use didim_drivers::source::{McapSource, SourceError};
use didim_formats::RecordingStart;

use super::input::{is_mcap, open_log};
use crate::window::{Window, WindowEnd};

/// Frames taken from the recording at a time.
const BATCH: usize = 256;

/// A window as it was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedWindow {
    /// Windows opened before this one since the stream began.
    pub number: u64,
    /// Sequence number of the first sample.
    pub first_sequence: u64,
    /// Stamp of the first sample \[ns\].
    pub first_stamp_ns: u64,
    /// Stamp of the last sample \[ns\].
    pub last_stamp_ns: u64,
    /// Samples, margins included.
    pub samples: usize,
    /// What ended it.
    pub end: WindowEnd,
    /// When the first sample was recorded, as the result says it; nothing where that is not known.
    pub start: Option<RecordingStart>,
    /// Hash of the configuration that it was identified with; nothing where the recording does not
    /// say.
    pub configuration: Option<String>,
}

const NUMBER: &str = "window";
const FIRST_SEQUENCE: &str = "window_first_sequence";
const FIRST_STAMP: &str = "window_first_stamp_ns";
const LAST_STAMP: &str = "window_last_stamp_ns";
const SAMPLES: &str = "window_samples";
const END: &str = "window_end";
const START: &str = "window_recorded";
const CONFIGURATION: &str = "window_configuration";

impl RecordedWindow {
    /// The record of a window that is identified with this configuration (its hash).
    pub fn of(window: &Window, configuration: &str) -> Self {
        let stamp = |sample: Option<&didim_core::JointSample>| sample.map_or(0, |s| s.stamp_ns);
        Self {
            number: window.number,
            first_sequence: window.first_sequence(),
            first_stamp_ns: stamp(window.samples.first()),
            last_stamp_ns: stamp(window.samples.last()),
            samples: window.samples.len(),
            end: window.end,
            start: window.start,
            configuration: Some(configuration.to_owned()),
        }
    }

    /// For the metadata of a recording.
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let end = serde_json::to_value(self.end).ok();
        let end = end.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default().to_owned();
        let fields = [
            (NUMBER, self.number.to_string()),
            (FIRST_SEQUENCE, self.first_sequence.to_string()),
            (FIRST_STAMP, self.first_stamp_ns.to_string()),
            (LAST_STAMP, self.last_stamp_ns.to_string()),
            (SAMPLES, self.samples.to_string()),
            (END, end),
        ];
        let configuration = self.configuration.clone().map(|hash| (CONFIGURATION, hash));
        let start = self.start.map(|start| (START, start.to_string()));
        let fields = fields.into_iter().chain(start).chain(configuration);
        fields.map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// From the metadata; nothing when there is no window in it.
    pub fn from_map(map: &BTreeMap<String, String>) -> Option<Self> {
        let number = |key: &str| map.get(key)?.parse::<u64>().ok();
        let end = serde_json::Value::String(map.get(END)?.clone());
        Some(Self {
            number: number(NUMBER)?,
            first_sequence: number(FIRST_SEQUENCE)?,
            first_stamp_ns: number(FIRST_STAMP)?,
            last_stamp_ns: number(LAST_STAMP)?,
            samples: usize::try_from(number(SAMPLES)?).ok()?,
            end: serde_json::from_value(end).ok()?,
            start: map.get(START).and_then(|start| start.parse().ok()),
            configuration: map.get(CONFIGURATION).cloned(),
        })
    }

    /// The window of a recording; nothing when it is of none.
    ///
    /// # Errors
    /// [`SourceError`]: the recording cannot be read.
    pub fn of_file(path: &Path) -> Result<Option<Self>, SourceError> {
        if !is_mcap(path) {
            return Ok(None);
        }
        let source = McapSource::open(path, &[])?;
        let Some(info) = source.info() else { return Ok(None) };
        Ok(Self::from_map(&info.more).map(|window| {
            // That of the recorder is older where the configuration was read again since.
            let configuration = window.configuration.or_else(|| Some(info.configuration.clone()));
            Self { configuration, ..window }
        }))
    }

    /// Whether it was recorded with this configuration (its hash), as far as that is known.
    pub fn is_of(&self, configuration: &str) -> bool {
        self.configuration.as_ref().is_none_or(|recorded| recorded == configuration)
    }

    /// The sequence that the first cycle of the recording had; nothing when its frames do not give
    /// the window's first sample, because `assembler` is another cell's or frames are missing.
    ///
    /// # Errors
    /// [`SourceError`]: the recording cannot be read.
    pub fn sequence_at_start(
        &self,
        path: &Path,
        assembler: Assembler,
    ) -> Result<Option<u64>, SourceError> {
        let source = open_log(path, Some(assembler.layout()))?;
        for sample in Samples::new(source, assembler, BATCH) {
            let sample = sample?;
            if sample.stamp_ns == self.first_stamp_ns {
                return Ok(self.first_sequence.checked_sub(sample.sequence));
            }
        }
        Ok(None)
    }
}
