//! The data needed to reproduce the result.

use std::ops::Range;
use std::path::Path;

use crate::text::to_hexadecimal;
use didim_formats::{Piece, RecordingStart};
use didim_identification::identification::{Method, Options};
use maud::{Markup, html};
use sha2::Sha256;

use super::super::date_text;
use super::{Report, number_text};
use crate::analysis::CountedPiece;
use crate::archive::store::{Timestamp, WindowProvenance};
use crate::cell::Cell;
use crate::window::{DriveReadings, Note};

/// Source of a result's samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// The file that was read, if the source is a file.
    pub input: Option<InputFile>,
    /// Range of the samples.
    pub samples: SampleRange,
    /// The files after the first, with the ranges of their samples.
    pub further_files: Vec<(InputFile, SampleRange)>,
    /// Note by a person, if any.
    pub note: Option<Note>,
}

/// Samples that a result was identified from.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleRange {
    /// Samples of a complete piece of a measurement.
    Measurement {
        /// Range of counted samples.
        counted: Range<usize>,
        /// Sample rate \[Hz\].
        rate_hz: f64,
        /// Start of the piece after the first sample of the measurement \[s\].
        begins_s: f64,
        /// Recording time of the measurement's first sample, if known.
        recorded: Option<RecordingStart>,
        /// Additional drive readings along the counted samples.
        readings: DriveReadings,
    },
    /// A window of the stream.
    Window(WindowProvenance),
}

impl SampleRange {
    /// Returns the range of a piece of a recording.
    pub fn from_piece(piece: &CountedPiece) -> Self {
        let Piece { begins_s, measurement, .. } = &piece.piece;
        Self::Measurement {
            counted: piece.counted_range.clone(),
            rate_hz: measurement.signals.sample_rate_hz,
            begins_s: *begins_s,
            recorded: piece.recording_start,
            readings: piece.readings(),
        }
    }

    /// Returns the range of the counted samples of a measurement, or within a window.
    pub fn counted(&self) -> Range<usize> {
        match self {
            Self::Measurement { counted, .. } => counted.clone(),
            Self::Window(window) => 0..window.counted,
        }
    }

    /// Returns the sample rate \[Hz\].
    pub fn rate_hz(&self) -> f64 {
        match self {
            Self::Measurement { rate_hz, .. } => *rate_hz,
            Self::Window(window) => window.sample_rate_hz,
        }
    }

    /// Returns the additional drive readings along the counted samples.
    pub fn readings(&self) -> &DriveReadings {
        match self {
            Self::Measurement { readings, .. } => readings,
            Self::Window(window) => &window.readings,
        }
    }
}

/// A file, identified by its name and content.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// Name of the file without its folder, which does not affect the result.
    pub name: String,
    /// SHA-256 of the file's content in hexadecimal digits.
    pub sha256: String,
    /// Time at which the file was last written. `None` if the system does not give it.
    pub written: Option<Timestamp>,
}

impl InputFile {
    /// Reads the complete file.
    ///
    /// # Errors
    /// The file cannot be read, or is not a regular file. Other files may be readable only once.
    pub fn read(path: &Path) -> std::io::Result<Self> {
        let mut digest = Sha256::default();
        if path.is_dir() {
            // The digest of a split bag covers its files one after the other, sorted by name.
            let entries = std::fs::read_dir(path)?;
            let mut files =
                entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
            files.retain(|file| file.is_file());
            files.sort_unstable();
            for file in files {
                std::io::copy(&mut std::fs::File::open(file)?, &mut digest)?;
            }
            return Ok(Self::new(path, digest));
        }
        let mut file = std::fs::File::open(path)?;
        if !file.metadata()?.is_file() {
            let why = "is not a regular file, so the report cannot state its SHA-256; copy it \
                to a regular file";
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, why));
        }
        std::io::copy(&mut file, &mut digest)?;
        Ok(Self::new(path, digest))
    }

    fn new(path: &Path, digest: Sha256) -> Self {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Self { name, sha256: to_hexadecimal(digest), written: Timestamp::of_file(path).ok() }
    }
}

pub(super) fn section(report: &Report<'_>) -> Markup {
    let content = html! {
        dl.provenance { (entries(report.cell, report.origin)) }
        @if let Some(options) = options(report) {
            details {
                summary { "Options of " (report.identification.estimate.method) }
                dl.expressions { @for (key, value) in options {
                    div { dt { (key) } dd { (value) } }
                } }
            }
        }
    };
    let explanation = "The same input file, configuration and program give this report again, \
        byte for byte, except for notes of a person. The configuration is the cell, robot and DBC \
        file.";
    super::section("Provenance", explanation, &content)
}

/// Lists input, samples, configuration and program.
pub fn entries(cell: &Cell, origin: &Origin) -> Markup {
    html! {
        @if let Some(input) = &origin.input {
            div { dt { "Input" } dd { (input.name) } }
            div { dt { "SHA-256 of the input" } dd.digest { (input.sha256) } }
        }
        (samples(&origin.samples, origin.input.as_ref()))
        @for (input, of) in &origin.further_files {
            div { dt { "Input" } dd { (input.name) } }
            div { dt { "SHA-256 of the input" } dd.digest { (input.sha256) } }
            (samples(of, Some(input)))
        }
        @if let Some(note) = &origin.note {
            @if let Some(payload) = note.payload_kg {
                div { dt { "Payload, as noted" } dd { (payload) " kg" } }
            }
            @if let Some(temperature) = note.temperature_c {
                div { dt { "Temperature, as noted" } dd { (temperature) " °C" } }
            }
            @if let Some(text) = &note.text { div { dt { "Note" } dd { (text) } } }
        }
        div { dt { "Configuration" } dd { "cell " (cell.name) ", robot " (cell.robot.name()) } }
        div {
            dt { "SHA-256 of the configuration" }
            dd.digest { (cell.configuration_sha256) }
        }
        div { dt { "Program" } dd { "didim " (env!("CARGO_PKG_VERSION")) } }
    }
}

fn samples(samples: &SampleRange, file: Option<&InputFile>) -> Markup {
    let written = file.and_then(|file| file.written);
    match samples {
        SampleRange::Measurement { counted, rate_hz, begins_s, recorded, readings } => html! {
            div { dt { "Recorded" } dd { (date_text(*recorded, written)) } }
            div { dt { "Sample rate" } dd { (rate_hz) " Hz" } }
            @if *begins_s > 0.0 {
                div { dt { "Cut before" } dd { (format!("{begins_s:.3} s")) } }
            }
            div { dt { "Samples that count" } dd {
                (counted.start) " to " (counted.end.saturating_sub(1)) ", "
                (seconds_text(counted.start, *rate_hz)) " to "
                (seconds_text(counted.end.saturating_sub(1), *rate_hz))
                " after the first" @if *begins_s > 0.0 { " of this piece" }
            } }
            (readings_list(readings))
        },
        SampleRange::Window(window) => html! {
            div { dt { "Recorded" } dd { (date_text(window.recorded, written)) } }
            div { dt { "Sample rate" } dd { (window.sample_rate_hz) " Hz" } }
            div { dt { "Window" } dd {
                (window.number) ", samples " (window.first_sequence) " to "
                (window.last_sequence) " of the stream"
            } }
            div { dt { "Samples that count" } dd {
                (window.counted) " from " (window.first_counted)
            } }
            (readings_list(&window.readings))
        },
    }
}

/// Lists the drive readings along the samples.
fn readings_list(readings: &DriveReadings) -> Markup {
    html! {
        @for (name, text) in readings.lines() {
            div { dt { (capitalise(name)) } dd { (text) } }
        }
    }
}

fn capitalise(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn seconds_text(samples: usize, rate_hz: f64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
    let seconds = samples as f64 / rate_hz;
    format!("{} s", number_text(seconds, 4))
}

/// Formats the options of the method as in a cell file.
fn options(report: &Report<'_>) -> Option<Vec<(String, String)>> {
    let method: Method = report.identification.estimate.method.parse().ok()?;
    let options = &report.cell.options;
    let used = match method.simulates() {
        true => options.clone(),
        false => Options { controller: None, simulation: Default::default(), ..options.clone() },
    };
    let mut entries = Vec::new();
    add_values(&mut entries, "", &toml::Value::try_from(used).ok()?);
    Some(entries)
}

/// Adds each value of a table with its key, which contains those of the tables around it.
fn add_values(entries: &mut Vec<(String, String)>, key: &str, value: &toml::Value) {
    match value {
        toml::Value::Table(table) => {
            for (name, value) in table {
                let dot = if key.is_empty() { "" } else { "." };
                add_values(entries, &format!("{key}{dot}{name}"), value);
            }
        }
        toml::Value::Array(values) if values.iter().any(toml::Value::is_table) => {
            for (number, value) in (1..).zip(values) {
                add_values(entries, &format!("{key}[{number}]"), value);
            }
        }
        value => entries.push((key.to_owned(), value.to_string())),
    }
}

/// Returns the date of the recording, as far as it is known.
pub(super) fn recording_date(origin: &Origin) -> String {
    let written = origin.input.as_ref().and_then(|input| input.written);
    match &origin.samples {
        SampleRange::Measurement { recorded, .. } => date_text(*recorded, written),
        SampleRange::Window(window) => date_text(window.recorded, written),
    }
}
