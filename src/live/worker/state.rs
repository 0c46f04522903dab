//! The worker's status.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use didim_core::identification::Estimate;
use serde::{Deserialize, Serialize};

use super::load_status::LoadStatus;
use super::log_rate::LogRate;
use super::window::{RejectedWindow, Rejection};
use crate::archive::drift::DriftStatus;
use crate::archive::store::{FoundLoad, ParameterValue};
use crate::live::latency::{Latencies, LatencySummary};
use crate::live::recording::{ArchiveStatus, SharedArchive};
use crate::live::stream::Batch;
use crate::window::{DriveReadings, Note, Window};

/// State of the current window.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum WindowState {
    /// None is open.
    #[default]
    Idle,
    /// One is open.
    Open {
        /// Samples in it.
        samples: usize,
    },
}

/// Summary of the last estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateSummary {
    /// [`Window::number`].
    pub window: u64,
    /// Sequence number of the window's first sample.
    pub first_sequence: u64,
    /// Sequence number of the window's last sample.
    pub last_sequence: u64,
    /// Method.
    pub method: String,
    /// The parameters with their standard deviations, in the model's order.
    pub parameters: Vec<ParameterValue>,
    /// ‖y − Xθ‖ / ‖y‖; nothing when it is not a number.
    pub relative_error: Option<f64>,
    /// Condition number; nothing when it is not finite.
    pub condition_number: Option<f64>,
    /// Whether it may be used for all that the cell asks for.
    pub applicable: bool,
    /// The reasons against it.
    pub reasons: Vec<String>,
    /// The reasons against monitoring with it.
    #[serde(default)]
    pub monitoring_reasons: Vec<String>,
    /// What the arm carried along it; nothing where that cannot be told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<FoundLoad>,
    /// What the drives told besides along the samples that count.
    #[serde(flatten)]
    pub readings: DriveReadings,
}

impl EstimateSummary {
    pub(super) fn new(window: &Window, estimate: &Estimate, load: Option<FoundLoad>) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        Self {
            window: window.number,
            first_sequence: window.first_sequence(),
            last_sequence: window.last_sequence(),
            method: estimate.method.clone(),
            parameters: ParameterValue::of(estimate),
            relative_error: finite(estimate.relative_error),
            condition_number: finite(estimate.condition_number),
            applicable: estimate.verdict.applicable,
            reasons: estimate.verdict.reasons.iter().map(ToString::to_string).collect(),
            monitoring_reasons: (estimate.verdict.uses.monitoring.reasons.iter())
                .map(ToString::to_string)
                .collect(),
            load,
            readings: window.readings(),
        }
    }
}

/// Counts of one run of the worker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimationStatus {
    /// Batches received.
    pub batches: u64,
    /// Samples received.
    pub samples: u64,
    /// Samples that the sequence numbers show to be missing, for whatever cause.
    pub samples_missing: u64,
    /// Batches overwritten in the buffer because the worker was too slow.
    pub batches_lost: u64,
    /// Times the acquisition was restarted while the worker was running.
    pub restarts: u64,
    /// No sample has come for so long \[s\]; told where the acquisition is another process, and is not
    /// known to rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_samples_s: Option<u64>,
    /// How long samples lay in the buffer until the worker took them, since the start; nothing
    /// before the first; of samples whose frames were read together, from when those had been read. A
    /// sample waits for its batch, of 64 samples or 50 ms.
    pub buffer_to_worker: Option<LatencySummary>,
    /// The same from the sending of their batch: what it takes to wake the worker, and longer where
    /// that is busy.
    pub batch_to_worker: Option<LatencySummary>,
    /// Hash of the configuration of the open window, or of the next one.
    pub configuration: String,
    /// Another configuration waits for the open window to close.
    pub configuration_waits: bool,
    /// The current window.
    pub window: WindowState,
    /// Windows opened.
    pub windows_opened: u64,
    /// Windows identified, whatever the verdict.
    pub windows_identified: u64,
    /// Windows rejected, by cause.
    pub windows_rejected: BTreeMap<String, u64>,
    /// Results that are not on disk yet, and are tried again.
    pub results_waiting: u64,
    /// Why they are not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub results_wait_for: Option<String>,
    /// Lines of stored results that the history lacks, and that are tried again.
    pub history_lines_waiting: u64,
    /// Why it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub history_waits_for: Option<String>,
    /// Windows waiting for the identification or in it.
    pub windows_pending: u64,
    /// The first rejection.
    pub first_rejection: Option<RejectedWindow>,
    /// The last rejection.
    pub last_rejection: Option<RejectedWindow>,
    /// The last estimate.
    pub last_estimate: Option<EstimateSummary>,
    /// Recordings kept of results, faults and captures; nothing where nothing is recorded.
    pub kept_recordings: Option<ArchiveStatus>,
    /// What is noted with the open window or the next one.
    pub note: Option<Note>,
    /// How the last estimate differs from the baseline; nothing without one.
    pub drift: Option<DriftStatus>,
    /// What the arm carries beyond what it did with the baseline; nothing where no results are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<LoadStatus>,
    /// Why nothing is compared although there is a baseline: it cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline_unreadable: Option<String>,
}

/// The counts, shared between the worker's threads and the status. The bus thread has no part in
/// it.
#[derive(Clone, Debug, Default)]
pub struct SharedEstimation(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    status: Mutex<EstimationStatus>,
    /// Windows between being closed and being counted.
    pending: Mutex<Vec<Pending>>,
    log_rate: Mutex<LogRate>,
    iterations: AtomicU64,
    buffer_to_worker: Latencies,
    batch_to_worker: Latencies,
    archive: OnceLock<SharedArchive>,
}

#[derive(Debug)]
struct Pending {
    /// What is counted at a stop.
    given_up: RejectedWindow,
    stage: Stage,
}

/// How far a window is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// It waits or is being identified, and can be given up.
    Wanted,
    /// Its result is being stored.
    Claimed,
    /// Its result waits for the disk, and the next window can be identified.
    Unstored,
}

/// Whoever panicked left counts, not a broken structure.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SharedEstimation {
    /// A copy of the counts.
    pub fn snapshot(&self) -> EstimationStatus {
        let mut status = self.update().clone();
        status.windows_pending = self.pending() as u64;
        status.buffer_to_worker = self.0.buffer_to_worker.summary();
        status.batch_to_worker = self.0.batch_to_worker.summary();
        status.kept_recordings = self.0.archive.get().map(SharedArchive::snapshot);
        status
    }

    /// Iterations of the worker's loop: they continue as long as it is healthy, samples or not.
    pub fn iterations(&self) -> u64 {
        self.0.iterations.load(Ordering::Relaxed)
    }

    /// [`EstimationStatus::samples`], without a copy of the rest.
    pub fn samples(&self) -> u64 {
        self.update().samples
    }

    pub(super) fn set_archive(&self, archive: SharedArchive) {
        let _ = self.0.archive.set(archive);
    }

    pub(crate) fn count_iteration(&self) {
        self.0.iterations.fetch_add(1, Ordering::Relaxed);
    }

    /// A batch is taken at `taken_ns` \[ns, CLOCK_MONOTONIC\].
    pub(super) fn record_taken(&self, batch: &Batch, taken_ns: u64) {
        self.0.batch_to_worker.record(taken_ns.saturating_sub(batch.sent_ns()));
        for sample in batch.samples() {
            self.0.buffer_to_worker.record(taken_ns.saturating_sub(sample.written_ns));
        }
    }

    pub(super) fn update(&self) -> MutexGuard<'_, EstimationStatus> {
        lock(&self.0.status)
    }

    /// A window waits from now on.
    pub(super) fn pend(&self, window: &Window) {
        let given_up = RejectedWindow::new(window, Rejection::Stopped);
        lock(&self.0.pending).push(Pending { given_up, stage: Stage::Wanted });
    }

    /// Whether a window is still to be counted.
    pub(super) fn is_wanted(&self, number: u64) -> bool {
        lock(&self.0.pending).iter().any(|pending| pending.given_up.number == number)
    }

    /// Before the result of a window is stored; false when the window was given up meanwhile.
    pub(super) fn claim(&self, number: u64) -> bool {
        self.reach(number, Stage::Claimed)
    }

    /// The result of a window waits for the disk, unless it is counted already.
    pub(super) fn put_aside(&self, number: u64) {
        self.reach(number, Stage::Unstored);
    }

    fn reach(&self, number: u64, stage: Stage) -> bool {
        let mut pending = lock(&self.0.pending);
        let found = pending.iter_mut().find(|pending| pending.given_up.number == number);
        found.map(|pending| pending.stage = stage).is_some()
    }

    /// A window is not identified: what was noted with it goes to the next one, unless something
    /// newer was noted meanwhile.
    pub(super) fn return_note(&self, note: Option<Note>) {
        let mut status = self.update();
        let Some(note) = note else { return };
        status.note = Some(note.amended(status.note.take().unwrap_or_default()));
    }

    /// A window is counted.
    pub(super) fn settle(&self, number: u64) {
        lock(&self.0.pending).retain(|pending| pending.given_up.number != number);
    }

    /// Rejects every window that can still be given up.
    pub(super) fn give_up(&self) {
        let mut given_up = Vec::new();
        lock(&self.0.pending).retain(|pending| {
            if pending.stage == Stage::Wanted {
                given_up.push(pending.given_up.clone());
            }
            pending.stage != Stage::Wanted
        });
        given_up.into_iter().for_each(|window| self.reject(window));
    }

    /// Counts every result that is not stored as lost; says how many.
    pub(super) fn abandon(&self) -> usize {
        let lost = core::mem::take(&mut *lock(&self.0.pending));
        let mut status = self.update();
        status.results_waiting = 0;
        let why = status.results_wait_for.take();
        drop(status);
        let why = why.unwrap_or_else(|| "the service ended before".to_owned());
        for Pending { given_up, .. } in &lost {
            let rejection = Rejection::NotStored { why: why.clone() };
            self.reject(RejectedWindow { rejection, ..given_up.clone() });
        }
        lost.len()
    }

    /// Windows that wait or are being identified or stored.
    pub(super) fn pending(&self) -> usize {
        lock(&self.0.pending).iter().filter(|pending| pending.stage != Stage::Unstored).count()
    }

    /// Whether every window is counted, those whose results wait for the disk among them.
    pub(super) fn is_settled(&self) -> bool {
        lock(&self.0.pending).is_empty()
    }

    pub(super) fn reject(&self, rejected: RejectedWindow) {
        let cause = rejected.rejection.cause();
        if let Some(unlogged) = lock(&self.0.log_rate).admit(cause, Instant::now()) {
            let (window, first, last) =
                (rejected.number, rejected.first_sequence, rejected.last_sequence);
            let why = &rejected.rejection;
            match unlogged {
                0 => tracing::warn!(window, first, last, "window rejected: {why}"),
                _ => tracing::warn!(
                    window,
                    first,
                    last,
                    "window rejected: {why}; {unlogged} more were rejected since the last such \
                     message"
                ),
            }
        }
        let mut status = self.update();
        *status.windows_rejected.entry(cause.to_owned()).or_default() += 1;
        if status.first_rejection.is_none() {
            status.first_rejection = Some(rejected.clone());
        }
        status.last_rejection = Some(rejected);
    }
}
