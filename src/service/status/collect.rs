//! Creation of snapshots from the counts of the threads.

use core::time::Duration;
use std::time::Instant;

use serde::Deserialize;

use super::snapshot::{Health, ProcessStatus, SCHEMA, Snapshot, StreamStatus};
use crate::live::acquire::{
    AcquisitionStatus, ReceiveBuffer, RecentWatch, SampleFlow, SharedAcquisition,
};
use crate::live::stream::StreamOptions;
use crate::live::worker::SharedEstimation;

/// Time without a sample after which an estimation in a separate process reports it.
const WITHOUT_SAMPLES: Duration = Duration::from_secs(2);

/// Maximum age of the status of an acquisition in another process. An older status is ignored.
const MAX_STATUS_AGE: Duration = Duration::from_secs(3);

/// Collector of the counts of this process's threads. It also computes rates from the counts.
#[derive(Debug)]
pub struct Collector {
    cell: String,
    stream: StreamStatus,
    started: Instant,
    acquisition: Option<SharedAcquisition>,
    estimation: Option<SharedEstimation>,
    receive_buffer: Option<ReceiveBuffer>,
    /// Status of the process itself.
    pub process: ProcessStatus,
    /// Sample count of a worker without a bus in this process, and the time of its last increase.
    last_sample: (u64, Instant),
    /// Latest status of an acquisition in another process.
    other_process: Option<(AcquisitionStatus, Instant)>,
    /// Time of the last count of frames and samples, and both counts.
    last_count: Option<(Instant, u64, u64)>,
    /// Recent counts.
    recent: RecentWatch,
}

impl Collector {
    /// Creates the collector for the threads of this process. `receive_buffer` is the receive
    /// buffer of its sockets.
    pub fn new(
        options: &StreamOptions,
        acquisition: Option<SharedAcquisition>,
        estimation: Option<SharedEstimation>,
        receive_buffer: Option<ReceiveBuffer>,
        now: Instant,
    ) -> Self {
        Self {
            cell: options.cell.clone(),
            stream: StreamStatus {
                sample_rate_hz: options.sample_rate_hz,
                buffer_s: options.buffer_s,
                shared_memory_bytes: options.shared_memory_bytes(),
            },
            started: now,
            acquisition,
            estimation,
            receive_buffer,
            process: ProcessStatus::default(),
            last_sample: (0, now),
            other_process: None,
            last_count: None,
            recent: RecentWatch::new(now),
        }
    }

    /// Returns a snapshot of the current state. Its rates are averages since the previous snapshot.
    pub fn snapshot(&mut self, now: Instant) -> Snapshot {
        let acquisition = self.acquisition.as_ref().map(|shared| {
            let counts = shared.counts();
            let mut status = AcquisitionStatus::new(&counts, shared.grants());
            status.interfaces_down = shared.interfaces_down(&counts);
            status.recent = self.recent.handle_counts(&counts, now);
            status.recording = shared.recording();
            status.external_torque = shared.external_torque();
            status.frame_to_buffer = shared.frame_to_buffer();
            let at_start = self.receive_buffer.and_then(|is| is.granted_bytes);
            status.receive_buffer_bytes = counts.receive_buffer_bytes.map(u64::from).or(at_start);
            status.receive_buffer_asked_bytes = self.receive_buffer.map(|is| is.asked_bytes);
            if let Some((then, frames, samples)) = self.last_count {
                let elapsed_s = (now - then).as_secs_f64();
                status.frames_per_second = rate(status.frames, frames, elapsed_s);
                status.samples_per_second = rate(status.samples, samples, elapsed_s);
            }
            self.last_count = Some((now, status.frames, status.samples));
            status
        });
        let mut estimation = self.estimation.as_ref().map(SharedEstimation::snapshot);
        let mut idle = false;
        if let (None, Some(estimation)) = (&acquisition, &mut estimation)
            && let Some(silent) = self.without_samples(estimation.samples, now)
        {
            let other = self.other_process.as_ref();
            let heard =
                other.filter(|(_, then)| now.saturating_duration_since(*then) < MAX_STATUS_AGE);
            let resting = heard.filter(|(other, _)| other.is_at_rest());
            idle = resting.is_some_and(|(other, _)| other.flow() == SampleFlow::Idle);
            estimation.without_samples_s = resting.is_none().then_some(silent.as_secs());
        }
        let mut health = Health::new(acquisition.as_ref(), estimation.as_ref());
        health.idle |= idle;
        // Reasons that result from recent user actions come first.
        for reason in self.process.reasons().into_iter().rev() {
            health.ok = false;
            health.reasons.insert(0, reason);
        }
        Snapshot {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cell: self.cell.clone(),
            uptime_s: (now - self.started).as_secs_f64(),
            health,
            process: self.process.clone(),
            stream: self.stream.clone(),
            acquisition,
            estimation,
        }
    }
}

/// The used part of the status of another process.
#[derive(Deserialize)]
struct OtherProcess {
    acquisition: Option<AcquisitionStatus>,
}

impl Collector {
    /// Processes the status of an acquisition in another process.
    pub fn handle_document(&mut self, document: &[u8], now: Instant) {
        if let Ok(OtherProcess { acquisition: Some(status) }) = serde_json::from_slice(document) {
            self.other_process = Some((status, now));
        }
    }

    /// Returns the time for which another process has not sent samples. `None` while it is short.
    fn without_samples(&mut self, samples: u64, now: Instant) -> Option<Duration> {
        if samples != self.last_sample.0 {
            self.last_sample = (samples, now);
        }
        let silent = now.saturating_duration_since(self.last_sample.1);
        (silent >= WITHOUT_SAMPLES).then_some(silent)
    }
}

#[expect(clippy::cast_precision_loss, reason = "a rate for people")]
fn rate(now: u64, before: u64, elapsed_s: f64) -> f64 {
    if elapsed_s > 0.0 { now.saturating_sub(before) as f64 / elapsed_s } else { 0.0 }
}
