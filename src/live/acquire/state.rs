//! Counts of the bus thread, which other threads read without blocking it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, TryLockError};

use didim_drivers::source::{InterfaceFault, InterfaceName};
use serde::{Deserialize, Serialize};

use super::counters::FaultCounters;
use super::counts::{AcquisitionCounts, BusState, FrameTime};
use super::real_time::RealTimeGrants;
use super::recent::{RecentCounts, SampleFlow, by_cause};
use crate::live::external_torque::{ExternalTorqueStatus, SharedExternalTorque};
use crate::live::latency::{Latencies, LatencySummary};
use crate::live::recording::{RecordingStatus, SharedRecording};
use crate::window::DriveReadings;

/// Latency from the arrival of a frame to its sample in the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameLatency {
    /// Start of the times. It is [`FrameTime::Read`] if any frame had no stamp.
    pub from: FrameTime,
    /// Summary of the times.
    #[serde(flatten)]
    pub times: LatencySummary,
}

/// Fault of an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InterfaceProblem {
    /// The interface is down.
    Down,
    /// There is no interface of this name.
    Missing,
}

impl From<InterfaceFault> for InterfaceProblem {
    fn from(fault: InterfaceFault) -> Self {
        match fault {
            InterfaceFault::Down => Self::Down,
            InterfaceFault::Missing => Self::Missing,
        }
    }
}

/// Shared counts of the bus thread. The thread writes them periodically, and skips an update while
/// they are being read.
#[derive(Clone, Debug, Default)]
pub struct SharedAcquisition(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    counts: Mutex<AcquisitionCounts>,
    frame_to_buffer: Latencies,
    grants: OnceLock<RealTimeGrants>,
    recording: OnceLock<SharedRecording>,
    external_torque: OnceLock<SharedExternalTorque>,
    interfaces: OnceLock<Vec<InterfaceName>>,
}

impl SharedAcquisition {
    /// Returns the latest counts.
    pub fn counts(&self) -> AcquisitionCounts {
        *self.0.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns [`AcquisitionStatus::frame_to_buffer`].
    pub fn frame_to_buffer(&self) -> Option<FrameLatency> {
        let times = self.0.frame_to_buffer.summary()?;
        Some(FrameLatency { from: self.counts().frame_time, times })
    }

    pub(super) fn record_frame_to_buffer(&self, ns: u64) {
        self.0.frame_to_buffer.count_time(ns);
    }

    /// Returns the real-time properties granted to the thread. `None` before the thread runs.
    pub fn grants(&self) -> Option<RealTimeGrants> {
        self.0.grants.get().cloned()
    }

    pub(super) fn set_grants(&self, grants: RealTimeGrants) {
        // If the thread is started a second time, the first value stays.
        let _ = self.0.grants.set(grants);
    }

    pub(super) fn set_interfaces(&self, interfaces: &[InterfaceName]) {
        let _ = self.0.interfaces.set(interfaces.to_vec());
    }

    /// Returns [`AcquisitionStatus::interfaces_down`].
    pub fn interfaces_down(
        &self,
        counts: &AcquisitionCounts,
    ) -> BTreeMap<String, InterfaceProblem> {
        let names = self.0.interfaces.get().into_iter().flatten().enumerate();
        let faults = names.filter_map(|(index, name)| {
            Some((name.to_string(), counts.interface_faults.get(index)?.into()))
        });
        faults.collect()
    }

    /// Returns the status of the recorder. `None` if nothing is recorded.
    pub fn recording(&self) -> Option<RecordingStatus> {
        self.0.recording.get().map(SharedRecording::snapshot)
    }

    /// Returns the status of the observer. `None` if no external torque is estimated.
    pub fn external_torque(&self) -> Option<ExternalTorqueStatus> {
        self.0.external_torque.get().map(SharedExternalTorque::snapshot)
    }

    pub(crate) fn set_external_torque(&self, external_torque: SharedExternalTorque) {
        let _ = self.0.external_torque.set(external_torque);
    }

    pub(crate) fn set_recording(&self, recording: SharedRecording) {
        let _ = self.0.recording.set(recording);
    }

    /// Publishes the counts unless they are being read. Never waits.
    pub(super) fn try_publish(&self, counts: &AcquisitionCounts) {
        match self.0.counts.try_lock() {
            Ok(mut place) => *place = *counts,
            Err(TryLockError::Poisoned(place)) => *place.into_inner() = *counts,
            Err(TryLockError::WouldBlock) => {}
        }
    }

    /// Publishes the final counts. Waits for a reader, which only copies them.
    pub(crate) fn publish(&self, counts: &AcquisitionCounts) {
        *self.0.counts.lock().unwrap_or_else(PoisonError::into_inner) = *counts;
    }
}

/// Acquisition part of a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AcquisitionStatus {
    /// State of the bus.
    pub bus: BusState,
    /// Interfaces that deliver no frames at present, with their fault.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub interfaces_down: BTreeMap<String, InterfaceProblem>,
    /// Number of received frames, including error frames.
    pub frames: u64,
    /// Frames per second over the last status period.
    pub frames_per_second: f64,
    /// Number of assembled samples.
    pub samples: u64,
    /// Samples per second over the last status period.
    pub samples_per_second: f64,
    /// Number of batches sent to the workers.
    pub batches: u64,
    /// Counters of faults.
    #[serde(flatten)]
    pub counters: FaultCounters,
    /// Latency from the frame that completed a sample to the sample in the buffer, since the start.
    /// On a bus with SYNC, the next SYNC completes a sample. `None` before the first sample. `from`
    /// states the start of the time. Up to 256 frames are read together, and their samples count as
    /// written with the last one. The latency is therefore too long by the writing time, and never
    /// too short. Samples that a silence of the bus completed do not count.
    pub frame_to_buffer: Option<FrameLatency>,
    /// Unused frames by cause. Causes that did not occur are omitted.
    pub frames_unused: BTreeMap<String, u64>,
    /// Bus cycles without a sample, by cause. Causes that did not occur are omitted.
    pub cycles_lost: BTreeMap<String, u64>,
    /// Counts of the last seconds.
    pub recent: RecentCounts,
    /// Latest additional drive readings while the bus is in a good state. Each value is listed
    /// once.
    #[serde(flatten)]
    pub readings: DriveReadings,
    /// Real-time properties granted to the thread.
    pub real_time: Option<RealTimeGrants>,
    /// Receive buffer granted by the kernel \[bytes\]. It is the smallest one of all interfaces.
    pub receive_buffer_bytes: Option<u64>,
    /// Receive buffer requested by the cell \[bytes\].
    pub receive_buffer_asked_bytes: Option<u64>,
    /// Status of the recorder of raw frames. `None` if nothing is recorded.
    pub recording: Option<RecordingStatus>,
    /// External torque of each joint. `None` if it is not estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub external_torque: Option<ExternalTorqueStatus>,
}

/// Size of the kernel's buffer for received frames, in the kernel's accounting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceiveBuffer {
    /// Size requested by the cell \[bytes\].
    pub asked_bytes: u64,
    /// Size granted at the start, at the interface with the smallest one \[bytes\]. `None` while no
    /// interface is open.
    pub granted_bytes: Option<u64>,
}

impl AcquisitionStatus {
    /// Returns how the frames of the last seconds were converted. Returns [`SampleFlow::Well`]
    /// unless the bus is in a good state.
    pub fn flow(&self) -> SampleFlow {
        if self.bus == BusState::Ok { self.recent.flow() } else { SampleFlow::Well }
    }

    /// Returns true if no samples are assembled, but not because of a fault: the drives are
    /// disabled, or were disabled a moment ago.
    pub fn is_at_rest(&self) -> bool {
        self.bus == BusState::Ok
            && self.samples_per_second <= 0.0
            && !matches!(self.flow(), SampleFlow::Stopped { .. })
    }

    /// Converts the counts to the form of the snapshot. The caller adds rates and latencies.
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
