//! What the bus thread counts, and how others read it without holding it up.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, TryLockError};

use serde::{Deserialize, Serialize};

use super::counters::FaultCounters;
use super::counts::{AcquisitionCounts, BusState, FrameTime};
use super::real_time::RealTimeGrants;
use super::recent::{Flow, RecentCounts, by_cause};
use crate::live::latency::{Latencies, LatencySummary};
use crate::live::recording::{RecordingStatus, SharedRecording};
use crate::window::DriveReadings;

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
    pub(crate) fn publish(&self, counts: &AcquisitionCounts) {
        *self.0.counts.lock().unwrap_or_else(PoisonError::into_inner) = *counts;
    }
}

/// The acquisition in a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AcquisitionStatus {
    /// The state of the bus.
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
    /// Counters of faults.
    #[serde(flatten)]
    pub counters: FaultCounters,
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
    /// What was counted in the last seconds.
    pub recent: RecentCounts,
    /// What the drives told last besides, while the bus is well: each value once.
    #[serde(flatten)]
    pub readings: DriveReadings,
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
    /// What came of the frames of the last seconds, while some come.
    pub fn flow(&self) -> Flow {
        if self.bus == BusState::Ok { self.recent.flow() } else { Flow::Well }
    }

    /// Whether it assembles no sample and nothing is wrong with that: drives are disabled, or were just now.
    pub fn rests(&self) -> bool {
        self.bus == BusState::Ok
            && self.samples_per_second <= 0.0
            && !matches!(self.flow(), Flow::Stopped { .. })
    }

    /// The counts in the form of the snapshot; rates and latencies are the status's to add.
    pub fn new(counts: &AcquisitionCounts, real_time: Option<RealTimeGrants>) -> Self {
        let AcquisitionCounts { bus, source, losses, batches, readings, .. } = counts;
        Self {
            bus: *bus,
            frames: source.frames,
            samples: losses.samples,
            batches: *batches,
            counters: FaultCounters::of(counts),
            frames_unused: by_cause(losses.frames.by_cause()),
            cycles_lost: by_cause(losses.cycles.by_cause()),
            readings: DriveReadings::of(bus.is_well().then_some(readings)),
            real_time,
            ..Self::default()
        }
    }
}
