//! Changes of the bus, of the machine and of the health, with their time: one line each in a file
//! of bounded size.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::skipped_lines::SkippedLines;
use super::store::Timestamp;

/// Maximum length of a file \[bytes\]. A line has about 200. The full file becomes the older one,
/// so that two files exist at most.
const MAX_FILE: u64 = 1 << 20;
/// Maximum length of a line \[bytes\].
const MAX_LINE: u64 = 1 << 14;
/// Suffix of the older file.
const OLDER_SUFFIX: &str = "old";

/// Process of a service, each of which has a file of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventSource {
    /// The process that identifies, with or without the bus.
    Service,
    /// The acquisition in a separate process.
    Acquisition,
}

impl EventSource {
    /// Returns the path of its events in a results folder.
    pub fn file_in(self, folder: &Path) -> PathBuf {
        folder.join(match self {
            Self::Service => "events.jsonl",
            Self::Acquisition => "events-acquisition.jsonl",
        })
    }
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// An interface is down.
    InterfaceDown,
    /// An interface does not exist.
    InterfaceMissing,
    /// Frames came, and come no more.
    Silence,
    /// Bus cycles give no sample.
    LostCycles,
    /// Frames were dropped before they were read.
    DroppedFrames,
    /// The computer's clock was set.
    ClockStep,
    /// The process was stopped.
    ProcessStopped,
    /// The machine was suspended.
    MachineSuspended,
    /// The process got no processor.
    NoProcessor,
    /// The health is bad.
    Unhealthy,
}

impl EventKind {
    /// Every kind.
    pub const ALL: [Self; 10] = [
        Self::InterfaceDown,
        Self::InterfaceMissing,
        Self::Silence,
        Self::LostCycles,
        Self::DroppedFrames,
        Self::ClockStep,
        Self::ProcessStopped,
        Self::MachineSuspended,
        Self::NoProcessor,
        Self::Unhealthy,
    ];

    /// Returns the key in JSON and metrics, the sentence at the beginning, and that at the end.
    const fn texts(self) -> [&'static str; 3] {
        match self {
            Self::InterfaceDown => {
                ["interface-down", "the interface is down", "the interface is up again"]
            }
            Self::InterfaceMissing => [
                "interface-missing",
                "the interface does not exist",
                "the interface is there again",
            ],
            Self::Silence => ["silence", "the bus is silent", "frames come again"],
            Self::LostCycles => ["lost-cycles", "bus cycles are lost", "no more cycles are lost"],
            Self::DroppedFrames => {
                ["dropped-frames", "frames are dropped unread", "no more frames are dropped"]
            }
            Self::ClockStep => ["clock-step", "the clock was set", "the clock was set"],
            Self::ProcessStopped => {
                ["process-stopped", "the process was stopped", "the process was stopped"]
            }
            Self::MachineSuspended => {
                ["machine-suspended", "the machine was suspended", "the machine was suspended"]
            }
            Self::NoProcessor => {
                let text = "the process got no processor";
                ["no-processor", text, text]
            }
            Self::Unhealthy => ["unhealthy", "the health is bad", "the health is good again"],
        }
    }

    /// Returns the key in JSON and metrics.
    pub const fn key(self) -> &'static str {
        self.texts()[0]
    }
}

/// Part of a change that an event reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// The state begins.
    Begins,
    /// The state has ended.
    Ends,
    /// The change is complete.
    Once,
}

/// One event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Time of day.
    pub time: Timestamp,
    /// Kind of the event.
    pub event: EventKind,
    /// Part of the change.
    pub phase: Phase,
    /// Interface, if the event concerns one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interface: Option<String>,
    /// Number of occurrences, cycles or frames since the previous event of this kind.
    pub count: u64,
    /// Duration of a state that has ended, or of a pause \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Cause.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [_, begins, ends] = self.event.texts();
        if let Some(interface) = &self.interface {
            write!(f, "{interface}: ")?;
        }
        f.write_str(if self.phase == Phase::Ends { ends } else { begins })?;
        if self.count > 1 {
            write!(f, " ({} times)", self.count)?;
        }
        if let Some(duration) = self.duration_s {
            let word = if self.phase == Phase::Ends { "after" } else { "for" };
            write!(f, " {word} {duration:.1} s")?;
        }
        self.cause.iter().try_for_each(|cause| write!(f, ": {cause}"))
    }
}

/// Number and total duration of the events of a kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventCount {
    /// Number of events, or of beginnings of the state.
    pub count: u64,
    /// Total duration of states that have ended, and of pauses \[ms\].
    pub lasted_ms: u64,
}

/// Numbers of events by the key of their kind.
pub type EventCounts = BTreeMap<String, EventCount>;

/// Appends events to a file, whose size is bounded.
///
/// # Errors
/// Those of the file system.
pub fn append_events(path: &Path, events: &[Event]) -> io::Result<()> {
    let mut text = Vec::new();
    for event in events {
        serde_json::to_writer(&mut text, event)?;
        text.push(b'\n');
    }
    let mut file = OpenOptions::new().create(true).read(true).append(true).open(path)?;
    let length = file.metadata()?.len();
    if length > MAX_FILE {
        fs::rename(path, path.with_extension(OLDER_SUFFIX))?;
        file = OpenOptions::new().create(true).append(true).open(path)?;
    } else if length > 0 {
        // A power failure may have left half a line, which must not hide the next one.
        let mut last = [0];
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        if last != *b"\n" {
            text.insert(0, b'\n');
        }
    }
    file.write_all(&text)
}

/// Reads the events of a results folder, of all processes, oldest first. Skips incomplete lines and
/// lines of a later version.
///
/// # Errors
/// Those of the file system. A missing file has no events.
pub fn read_events(folder: &Path) -> io::Result<Vec<Event>> {
    let mut events = Vec::new();
    for source in [EventSource::Service, EventSource::Acquisition] {
        let path = source.file_in(folder);
        read_file(&path.with_extension(OLDER_SUFFIX), &mut events)?;
        read_file(&path, &mut events)?;
    }
    // The sort keeps the order of events with the same time.
    events.sort_by_key(|event| event.time);
    Ok(events)
}

fn read_file(path: &Path, events: &mut Vec<Event>) -> io::Result<()> {
    let file = match File::open(path) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(()),
        opened => opened?,
    };
    let mut reader = BufReader::new(file);
    let (mut line, mut number, mut skipped) = (Vec::new(), 0, SkippedLines::default());
    // A longer line is read in pieces. No piece is an event.
    while (&mut reader).take(MAX_LINE).read_until(b'\n', &mut line)? > 0 {
        number += 1;
        match serde_json::from_slice::<Event>(&line) {
            Ok(event) => events.push(event),
            Err(_) => skipped.add(number),
        }
        line.clear();
    }
    skipped.warn(path);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(second: u64) -> Event {
        Event {
            time: Timestamp::from_unix_s(1_800_000_000 + second),
            event: EventKind::InterfaceDown,
            phase: Phase::Ends,
            interface: Some("can0".into()),
            count: 2,
            duration_s: Some(3.25),
            cause: Some("unplugged".into()),
        }
    }

    #[test]
    fn a_kind_has_one_name() {
        for kind in EventKind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.key());
        }
        let text = "can0: the interface is up again (2 times) after 3.2 s: unplugged";
        assert_eq!(event(0).to_string(), text);
    }

    #[test]
    fn the_file_is_bounded_and_half_a_line_hides_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = EventSource::Service.file_in(folder.path());
        append_events(&path, &[event(0)]).unwrap();
        let written = fs::read(&path).unwrap();
        fs::write(&path, [&written[..], &written[..20]].concat()).unwrap();
        append_events(&path, &[event(1)]).unwrap();
        append_events(&EventSource::Acquisition.file_in(folder.path()), &[event(2)]).unwrap();
        let read = read_events(folder.path()).unwrap();
        assert_eq!(read, [event(0), event(1), event(2)]);
        let many: Vec<Event> = (0..1_000).map(event).collect();
        for _ in 0..30 {
            append_events(&path, &many).unwrap();
        }
        let files = fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap());
        let bytes: u64 = files.map(|file| file.metadata().unwrap().len()).sum();
        assert!(bytes < 3 * MAX_FILE, "{bytes}");
        assert!(read_events(folder.path()).unwrap().len() > 5_000);
    }
}
