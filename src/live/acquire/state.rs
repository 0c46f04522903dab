//! Counts of the bus thread, and non-blocking access for other threads.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, TryLockError};

use serde::{Deserialize, Serialize};

use super::counters::FaultCounters;
use super::counts::{AcquisitionCounts, BusState, FrameTime};
use super::real_time::RealTimeGrants;
use super::recent::{RecentCounts, SampleFlow, by_cause};
use crate::live::latency::{Latencies, LatencySummary};
use crate::live::recording::{RecordingStatus, SharedRecording};
use crate::window::DriveReadings;

/// Latency of frames on the way to the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameLatency {
    /// Start of the times. It is [`FrameTime::Read`] even if only some frames had no stamp.
    pub from: FrameTime,
    /// The times.
    #[serde(flatten)]
    pub times: LatencySummary,
}

/// Shared counts of the bus thread. The thread writes them from time to time, and skips an update
/// while somebody is reading.
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
        self.0.frame_to_buffer.count_time(ns);
    }

    /// Returns the properties granted to the thread. `None` before it runs.
    pub fn grants(&self) -> Option<RealTimeGrants> {
        self.0.grants.get().cloned()
    }

    pub(super) fn set_grants(&self, grants: RealTimeGrants) {
        // A thread that is started a second time keeps the first value.
        let _ = self.0.grants.set(grants);
    }

    /// Returns the status of the recorder. `None` if nothing is recorded.
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

    /// Publishes the final counts. Waits for a reader, who only copies.
    pub(crate) fn publish(&self, counts: &AcquisitionCounts) {
        *self.0.counts.lock().unwrap_or_else(PoisonError::into_inner) = *counts;
    }
}

/// Acquisition part of a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AcquisitionStatus {
    /// The state of the bus.
    pub bus: BusState,
    /// Number of received frames, including error frames.
    pub frames: u64,
    /// Frames per second, over the last status period.
    pub frames_per_second: f64,
    /// Samples assembled.
    pub samples: u64,
    /// Samples per second, over the last status period.
    pub samples_per_second: f64,
    /// Number of batches sent to the workers.
    pub batches: u64,
    /// Counters of faults.
    #[serde(flatten)]
    pub counters: FaultCounters,
    /// Time from the frame that completed a sample (the next one on a bus with SYNC) until the
    /// sample was in the buffer, since the start. `None` before the first. Its `from` gives the
    /// start of the time. Up to 256 frames are read together, and all their samples count as
    /// written with the last one. The time is too long by the writing time, never too short. A
    /// sample that was completed by a silence and not by a frame does not count.
    pub frame_to_buffer: Option<FrameLatency>,
    /// Unused frames by cause. Causes that did not occur are left out.
    pub frames_unused: BTreeMap<String, u64>,
    /// Bus cycles without a sample, by cause. Causes that did not occur are left out.
    pub cycles_lost: BTreeMap<String, u64>,
    /// Counts of the last seconds.
    pub recent: RecentCounts,
    /// Latest additional drive readings, while the bus is in a good state: each value once.
    #[serde(flatten)]
    pub readings: DriveReadings,
    /// Properties granted to the thread.
    pub real_time: Option<RealTimeGrants>,
    /// Receive buffer granted by the kernel, the smallest of all interfaces \[bytes\].
    pub receive_buffer_bytes: Option<u64>,
    /// Receive buffer requested by the cell \[bytes\].
    pub receive_buffer_asked_bytes: Option<u64>,
    /// Recorder of raw frames. `None` if nothing is recorded.
    pub recording: Option<RecordingStatus>,
}

/// The kernel's buffer of received frames, as the kernel accounts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceiveBuffer {
    /// Size requested by the cell \[bytes\].
    pub asked_bytes: u64,
    /// Granted size at the interface with the smallest one \[bytes\].
    pub granted_bytes: u64,
}

impl AcquisitionStatus {
    /// Returns the outcome of the frames of the last seconds, as long as frames arrive.
    pub fn flow(&self) -> SampleFlow {
        if self.bus == BusState::Ok { self.recent.flow() } else { SampleFlow::Well }
    }

    /// Returns true if it assembles no samples without a fault: drives are disabled, or were until
    /// just now.
    pub fn is_at_rest(&self) -> bool {
        self.bus == BusState::Ok
            && self.samples_per_second <= 0.0
            && !matches!(self.flow(), SampleFlow::Stopped { .. })
    }

    /// Converts the counts to the form of the snapshot. The status adds rates and latencies.
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
            readings: DriveReadings::from_cycles(bus.is_well().then_some(readings)),
            real_time,
            ..Self::default()
        }
    }
}
