//! What the bus thread counts, and how others read it without holding it up.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, TryLockError};

use didim_drivers::assemble::Losses;
use didim_drivers::clock::ClockCounters;
use didim_drivers::source::SourceCounters;
use serde::{Deserialize, Serialize};

use super::real_time::RealTimeGrants;
use crate::live::latency::{Latencies, LatencySummary};
use crate::live::recording::{RecordingStatus, SharedRecording};

/// How the bus is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BusState {
    /// No frame has come yet.
    #[default]
    Waiting,
    /// Frames come.
    Ok,
    /// No frame for longer than the bus may be silent.
    Silent,
    /// The source fails: an interface is down or away.
    Down,
    /// The log is at its end.
    Ended,
}

/// What the bus thread counted, as of one instant: plain numbers, copied as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AcquisitionCounts {
    /// How the bus is.
    pub bus: BusState,
    /// The source's own counts.
    pub source: SourceCounters,
    /// The assembler's.
    pub losses: Losses,
    /// Batches sent to the workers.
    pub batches: u64,
    /// Times the source failed.
    pub source_failures: u64,
    /// What mapping the stamps of CLOCK_REALTIME counted.
    pub clock: ClockCounters,
    /// Where the latencies of frames begin.
    pub frame_time: FrameTime,
    /// Turns of the thread's loop: they go on as long as the thread is well, frames or not.
    pub turns: u64,
}

/// Where the way of a frame begins in [`FrameLatency`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrameTime {
    /// The stamp that the kernel or the controller gave the frame.
    Stamp,
    /// When the frame was read: how long it had lain in a queue before is not known. The bus has a
    /// time of its own (a log, an in-process bus), or frames came without a stamp
    /// ([`AcquisitionStatus::frames_stamped_late`]).
    #[default]
    Read,
}

/// How long frames are under way to the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameLatency {
    /// Where the times begin; at [`FrameTime::Read`] when only some frames had no stamp.
    pub from: FrameTime,
    /// The times.
    #[serde(flatten)]
    pub times: LatencySummary,
}

/// The bus thread's counts as others see them: it writes them now and then, and skips a turn when
/// somebody is reading.
#[derive(Clone, Debug, Default)]
pub struct SharedAcquisition(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    counts: Mutex<AcquisitionCounts>,
    frame_to_buffer: Latencies,
    grants: OnceLock<RealTimeGrants>,
    recording: OnceLock<SharedRecording>,
}

impl SharedAcquisition {
    /// The latest counts.
    pub fn counts(&self) -> AcquisitionCounts {
        *self.0.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// [`AcquisitionStatus::frame_to_buffer`].
    pub fn frame_to_buffer(&self) -> Option<FrameLatency> {
        let times = self.0.frame_to_buffer.summary()?;
        Some(FrameLatency { from: self.counts().frame_time, times })
    }

    pub(super) fn record_frame_to_buffer(&self, ns: u64) {
        self.0.frame_to_buffer.record(ns);
    }

    /// What the thread was given; nothing before it runs.
    pub fn grants(&self) -> Option<RealTimeGrants> {
        self.0.grants.get().cloned()
    }

    pub(super) fn set_grants(&self, grants: RealTimeGrants) {
        // A thread that is started a second time keeps the first word.
        let _ = self.0.grants.set(grants);
    }

    /// What the recorder tells; nothing where nothing is recorded.
    pub fn recording(&self) -> Option<RecordingStatus> {
        self.0.recording.get().map(SharedRecording::snapshot)
    }

    pub(crate) fn set_recording(&self, recording: SharedRecording) {
        let _ = self.0.recording.set(recording);
    }

    /// Never waits.
    pub(super) fn try_publish(&self, counts: &AcquisitionCounts) {
        match self.0.counts.try_lock() {
            Ok(mut place) => *place = *counts,
            Err(TryLockError::Poisoned(place)) => *place.into_inner() = *counts,
            Err(TryLockError::WouldBlock) => {}
        }
    }

    /// Waits for a reader, who only copies: for the last word.
    pub(super) fn publish(&self, counts: &AcquisitionCounts) {
        *self.0.counts.lock().unwrap_or_else(PoisonError::into_inner) = *counts;
    }
}

/// The acquisition in a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AcquisitionStatus {
    /// How the bus is.
    pub bus: BusState,
    /// Frames received, error frames included.
    pub frames: u64,
    /// Frames per second, over the last period of the status.
    pub frames_per_second: f64,
    /// Samples assembled.
    pub samples: u64,
    /// Samples per second, over the last period of the status.
    pub samples_per_second: f64,
    /// Batches sent to the workers.
    pub batches: u64,
    /// Frames dropped unread, by the kernel or an in-process bus.
    pub queue_drops: u64,
    /// Error frames of the controller.
    pub error_frames: u64,
    /// Times an interface was found down.
    pub link_down: u64,
    /// Times an interface was opened again.
    pub reopened: u64,
    /// Times the source failed.
    pub source_failures: u64,
    /// Frames passed over: of an interface that was not asked for, or of an unknown kind.
    pub frames_passed_over: u64,
    /// Frames without a stamp of the kernel, stamped when they were read.
    pub frames_stamped_late: u64,
    /// Samples without a reference although the layout has one.
    pub samples_without_reference: u64,
    /// Times the computer's clock was set.
    pub clock_steps: u64,
    /// Stamps that would have gone backwards and were held at the last one.
    pub stamps_held_back: u64,
    /// Stamps that lay in the future and were put to the present.
    pub stamps_in_future: u64,
    /// How long it took from the frame that completed a sample (where there are SYNCs, the next one)
    /// until the sample was in the buffer, since the start; nothing before the first. Its `from`
    /// tells what the frame's time is. Of frames read together, up to 256, all samples count as
    /// written with the last: too long by the time of writing, never too short. A sample that no
    /// frame completed, but a silence, does not count.
    pub frame_to_buffer: Option<FrameLatency>,
    /// Frames not used, by cause; causes that did not occur are left out.
    pub frames_unused: BTreeMap<String, u64>,
    /// Bus cycles without a sample, by cause; likewise.
    pub cycles_lost: BTreeMap<String, u64>,
    /// What the thread was given.
    pub real_time: Option<RealTimeGrants>,
    /// Receive buffer that the kernel granted, the smallest of all interfaces \[bytes\].
    pub receive_buffer_bytes: Option<u64>,
    /// Receive buffer that the cell asks for \[bytes\].
    pub receive_buffer_asked_bytes: Option<u64>,
    /// The recorder of raw frames; nothing where nothing is recorded.
    pub recording: Option<RecordingStatus>,
}

/// The kernel's buffer of received frames, as the kernel accounts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceiveBuffer {
    /// What the cell asks for \[bytes\].
    pub asked_bytes: u64,
    /// What was granted, at the interface that got least \[bytes\].
    pub granted_bytes: u64,
}

impl AcquisitionStatus {
    /// The counts in the form of the snapshot; rates and latencies are the status's to add.
    pub fn new(counts: &AcquisitionCounts, real_time: Option<RealTimeGrants>) -> Self {
        let AcquisitionCounts {
            bus,
            source,
            losses,
            batches,
            source_failures,
            clock,
            frame_time: _,
            turns: _,
        } = counts;
        Self {
            bus: *bus,
            frames: source.frames,
            samples: losses.samples,
            batches: *batches,
            queue_drops: source.queue_drops,
            error_frames: source.error_frames,
            link_down: source.link_down,
            reopened: source.reopened,
            source_failures: *source_failures,
            frames_passed_over: source.passed_over,
            frames_stamped_late: source.stamped_late,
            samples_without_reference: losses.samples_without_reference,
            clock_steps: clock.steps,
            stamps_held_back: clock.held_back,
            stamps_in_future: clock.future,
            frames_unused: by_cause(&losses.frames),
            cycles_lost: by_cause(&losses.cycles),
            real_time,
            ..Self::default()
        }
    }
}

/// The counters of a struct by their names, without those that are zero.
fn by_cause(counters: &impl Serialize) -> BTreeMap<String, u64> {
    let Ok(serde_json::Value::Object(fields)) = serde_json::to_value(counters) else {
        return BTreeMap::new();
    };
    fields
        .into_iter()
        .filter_map(|(cause, count)| Some((cause, count.as_u64().filter(|count| *count > 0)?)))
        .collect()
}
