//! The worker's status.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use didim_drivers::socket::monotonic_ns;
use didim_identification::identification::{Estimate, Use};
use serde::{Deserialize, Serialize};

use super::load_status::LoadStatus;
use super::log_rate::LogRate;
use super::window::{RejectedWindow, Rejection};
use crate::archive::Results;
use crate::archive::drift::DriftStatus;
use crate::archive::store::{FoundLoad, ParameterValue};
use crate::live::latency::{Latencies, LatencySummary};
use crate::live::limits::LiveLimits;
use crate::live::recording::{ArchiveStatus, SharedArchive, WriteStatus};
use crate::live::stream::Batch;
use crate::window::{DriveReadings, Note, Window};

/// State of the current window.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum WindowState {
    /// No window is open.
    #[default]
    Idle,
    /// A window is open.
    Open {
        /// Number of samples in the window.
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
    /// Name of the method.
    pub method: String,
    /// Parameters with their standard deviations, in the model's order.
    pub parameters: Vec<ParameterValue>,
    /// ‖y − Xθ‖ / ‖y‖. `None` if it is not a number.
    pub relative_error: Option<f64>,
    /// Condition number. `None` if it is not finite.
    pub condition_number: Option<f64>,
    /// True if the estimate is usable for every use that the cell requires.
    pub applicable: bool,
    /// Reasons why the estimate is not usable.
    pub reasons: Vec<String>,
    /// Reasons why the estimate is not usable for monitoring.
    #[serde(default)]
    pub monitoring_reasons: Vec<String>,
    /// Verdict for each use. Empty in the status of versions without this key.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uses: Vec<UseSummary>,
    /// Payload during the window. `None` if it is not identifiable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<FoundLoad>,
    /// Additional drive readings during the counted samples.
    #[serde(flatten)]
    pub readings: DriveReadings,
}

/// Verdict of the last estimate for one use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UseSummary {
    /// The use.
    #[serde(rename = "use")]
    pub usage: Use,
    /// True if the estimate is usable for it; `None` if that is undecided.
    pub applicable: Option<bool>,
    /// Reasons against the use.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reasons: Vec<String>,
}

impl UseSummary {
    fn new(usage: Use, estimate: &Estimate) -> Self {
        let verdict = estimate.verdict.uses.get(usage);
        let reasons = verdict.reasons.iter().map(ToString::to_string).collect();
        Self { usage, applicable: verdict.applicable, reasons }
    }
}

impl EstimateSummary {
    pub(super) fn new(window: &Window, estimate: &Estimate, load: Option<FoundLoad>) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        Self {
            window: window.number,
            first_sequence: window.first_sequence(),
            last_sequence: window.last_sequence(),
            method: estimate.method.clone(),
            parameters: ParameterValue::from_estimate(estimate),
            relative_error: finite(estimate.relative_error),
            condition_number: finite(estimate.condition_number),
            applicable: estimate.verdict.applicable,
            reasons: estimate.verdict.reasons.iter().map(ToString::to_string).collect(),
            monitoring_reasons: (estimate.verdict.uses.monitoring.reasons.iter())
                .map(ToString::to_string)
                .collect(),
            uses: Use::ALL.map(|usage| UseSummary::new(usage, estimate)).into(),
            load,
            readings: window.readings(),
        }
    }
}

/// Status of the worker: its counts since the start, and its latest results.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimationStatus {
    /// Number of batches received.
    pub batches: u64,
    /// Number of samples received.
    pub samples: u64,
    /// Number of missing samples, counted by gaps in the sequence numbers. The cause does not
    /// matter.
    pub samples_missing: u64,
    /// Number of batches overwritten in the buffer because the worker was too slow.
    pub batches_lost: u64,
    /// Number of acquisition restarts while the worker was running.
    pub restarts: u64,
    /// Time without a sample \[s\]. It is reported only if the acquisition is in another process
    /// and does not report disabled drives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_samples_s: Option<u64>,
    /// Latency from the writing of a sample to the buffer until the worker took it, since the
    /// start. `None` before the first sample. If frames were read together, it begins after that
    /// read. A sample waits until its batch is sent, after 64 samples or 50 ms.
    pub buffer_to_worker: Option<LatencySummary>,
    /// Latency from the sending of a batch until the worker took it. It is the time to wake the
    /// worker, and longer if the worker is busy.
    pub batch_to_worker: Option<LatencySummary>,
    /// Hash of the configuration of the open window, or of the next one.
    pub configuration: String,
    /// True if another configuration waits for the open window to close.
    pub configuration_waits: bool,
    /// The current window.
    pub window: WindowState,
    /// Number of windows opened.
    pub windows_opened: u64,
    /// Number of identified windows, independent of the verdict.
    pub windows_identified: u64,
    /// Number of rejected windows, by cause.
    pub windows_rejected: BTreeMap<String, u64>,
    /// Number of results that are not stored yet. Storing them is tried again.
    pub results_waiting: u64,
    /// Reason why the results could not be stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub results_wait_for: Option<String>,
    /// Number of pending history lines of stored results. Appending them is tried again.
    pub history_lines_waiting: u64,
    /// Reason why the history lines could not be appended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub history_waits_for: Option<String>,
    /// Number of windows that are queued or being identified.
    pub windows_pending: u64,
    /// The first rejection.
    pub first_rejection: Option<RejectedWindow>,
    /// The last rejection.
    pub last_rejection: Option<RejectedWindow>,
    /// The last estimate.
    pub last_estimate: Option<EstimateSummary>,
    /// Kept recordings of results, faults and captures. `None` if nothing is recorded.
    pub kept_recordings: Option<ArchiveStatus>,
    /// Bytes written for results and kept recordings, and the budget.
    pub written: WriteStatus,
    /// Note for the open window or the next one.
    pub note: Option<Note>,
    /// Differences between the last estimate and the baseline. `None` without a baseline.
    pub drift: Option<DriftStatus>,
    /// Payload relative to that of the baseline. `None` if no results are stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<LoadStatus>,
    /// Reason why an existing baseline cannot be read. Results are not compared then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline_unreadable: Option<String>,
}

impl EstimationStatus {
    /// Sets the drift, reasons that prevent its evaluation, and the pending history lines.
    pub(crate) fn set_results(&mut self, results: &Results) {
        self.drift = results.drift();
        self.baseline_unreadable = results.baseline_error().map(str::to_owned);
        self.set_pending_lines(results);
    }

    /// Sets the number of pending history lines, and the reason.
    pub(crate) fn set_pending_lines(&mut self, results: &Results) {
        let (lines, why) = results.pending_count();
        self.history_lines_waiting = lines as u64;
        self.history_waits_for = why.map(str::to_owned);
    }
}

/// Counts shared between the worker's threads and the status. The bus thread does not use them.
#[derive(Clone, Debug, Default)]
pub struct SharedEstimation(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    status: Mutex<EstimationStatus>,
    /// Closed windows that are not counted as identified or rejected yet.
    pending: Mutex<Vec<PendingWindow>>,
    log_rate: Mutex<LogRate>,
    iterations: AtomicU64,
    /// Time of the last sign of life of the identification \[ns\], or 0 before the first one.
    identification_ns: AtomicU64,
    buffer_to_worker: Latencies,
    batch_to_worker: Latencies,
    archive: OnceLock<SharedArchive>,
}

#[derive(Debug)]
struct PendingWindow {
    /// Rejection that is counted if a stop abandons the window.
    given_up: RejectedWindow,
    stage: WindowStage,
}

/// Stage of a pending window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WindowStage {
    /// The window is queued or being identified, and can be abandoned.
    Wanted,
    /// The result of the window is being stored.
    Claimed,
    /// The result of the window waits for the disk. The next window can be identified.
    Unstored,
}

/// Locks a mutex. A poisoned lock is used as well, because a panicked thread leaves valid counts.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SharedEstimation {
    /// Returns a copy of the counts.
    pub fn snapshot(&self) -> EstimationStatus {
        let mut status = self.update().clone();
        status.windows_pending = self.pending_count() as u64;
        status.buffer_to_worker = self.0.buffer_to_worker.summary();
        status.batch_to_worker = self.0.batch_to_worker.summary();
        status.kept_recordings = self.0.archive.get().map(SharedArchive::snapshot);
        status
    }

    /// Returns the iterations of the worker's loop. The number grows while the worker is healthy,
    /// with or without samples.
    pub fn iterations(&self) -> u64 {
        self.0.iterations.load(Ordering::Relaxed)
    }

    /// Returns [`EstimationStatus::samples`] without copying the other counts.
    pub fn samples(&self) -> u64 {
        self.update().samples
    }

    /// Records a sign of life of the thread that identifies and stores.
    pub(crate) fn count_identification(&self) {
        self.0.identification_ns.store(monotonic_ns(), Ordering::Relaxed);
    }

    /// Returns true if the thread that identifies and stores has given no sign of life for too long
    /// before `now_ns`: a computation or a disk hangs.
    pub(crate) fn is_identification_stuck(&self, now_ns: u64) -> bool {
        let last_ns = self.0.identification_ns.load(Ordering::Relaxed);
        let since = Duration::from_nanos(now_ns.saturating_sub(last_ns));
        last_ns > 0 && since > LiveLimits::DEFAULT.stuck
    }

    pub(super) fn set_archive(&self, archive: SharedArchive) {
        let _ = self.0.archive.set(archive);
    }

    pub(crate) fn count_iteration(&self) {
        self.0.iterations.fetch_add(1, Ordering::Relaxed);
    }

    /// Records that a batch was taken at `taken_ns` \[ns, CLOCK_BOOTTIME\].
    pub(super) fn record_taken(&self, batch: &Batch, taken_ns: u64) {
        self.0.batch_to_worker.count_time(taken_ns.saturating_sub(batch.sent_ns()));
        for sample in batch.samples() {
            self.0.buffer_to_worker.count_time(taken_ns.saturating_sub(sample.written_ns));
        }
    }

    pub(super) fn update(&self) -> MutexGuard<'_, EstimationStatus> {
        lock(&self.0.status)
    }

    /// Adds a window to the pending ones.
    pub(super) fn add_pending(&self, window: &Window) {
        let given_up = RejectedWindow::new(window, Rejection::Stopped);
        lock(&self.0.pending).push(PendingWindow { given_up, stage: WindowStage::Wanted });
    }

    /// Returns true if a window is still pending, so that its result is needed.
    pub(super) fn is_wanted(&self, number: u64) -> bool {
        lock(&self.0.pending).iter().any(|pending| pending.given_up.number == number)
    }

    /// Returns the same for a thread that waits for the result, which is a sign of its life.
    pub(super) fn is_wanted_now(&self, number: u64) -> bool {
        self.count_identification();
        self.is_wanted(number)
    }

    /// Marks a window before its result is stored, so that it can no longer be abandoned. Returns
    /// false if it was abandoned before.
    pub(super) fn claim_window(&self, number: u64) -> bool {
        self.reach_stage(number, WindowStage::Claimed)
    }

    /// Marks that the result of a window waits for the disk, unless the window has been counted
    /// already.
    pub(super) fn put_aside(&self, number: u64) {
        self.reach_stage(number, WindowStage::Unstored);
    }

    fn reach_stage(&self, number: u64, stage: WindowStage) -> bool {
        let mut pending = lock(&self.0.pending);
        let entry = pending.iter_mut().find(|pending| pending.given_up.number == number);
        entry.map(|pending| pending.stage = stage).is_some()
    }

    /// Passes the note of a window that was not identified to the next window, unless a newer note
    /// exists.
    pub(super) fn return_note(&self, note: Option<Note>) {
        let mut status = self.update();
        let Some(note) = note else { return };
        status.note = Some(note.amend(status.note.take().unwrap_or_default()));
    }

    /// Removes a counted window from the pending ones.
    pub(super) fn settle(&self, number: u64) {
        lock(&self.0.pending).retain(|pending| pending.given_up.number != number);
    }

    /// Rejects every window that can still be abandoned.
    pub(super) fn give_up(&self) {
        let mut given_up = Vec::new();
        lock(&self.0.pending).retain(|pending| {
            if pending.stage == WindowStage::Wanted {
                given_up.push(pending.given_up.clone());
            }
            pending.stage != WindowStage::Wanted
        });
        given_up.into_iter().for_each(|window| self.reject(window));
    }

    /// Counts every result that is not stored as lost, and returns their number.
    pub(super) fn abandon_all(&self) -> usize {
        let count = core::mem::take(&mut *lock(&self.0.pending));
        let mut status = self.update();
        status.results_waiting = 0;
        let why = status.results_wait_for.take();
        drop(status);
        let why = why.unwrap_or_else(|| "the service ended before".to_owned());
        for PendingWindow { given_up, .. } in &count {
            let rejection = Rejection::NotStored { why: why.clone() };
            self.reject(RejectedWindow { rejection, ..given_up.clone() });
        }
        count.len()
    }

    /// Returns the number of windows that wait or are being identified or stored.
    pub(super) fn pending_count(&self) -> usize {
        lock(&self.0.pending)
            .iter()
            .filter(|pending| pending.stage != WindowStage::Unstored)
            .count()
    }

    /// Returns true if every window is counted, including those whose results wait for the disk.
    pub(super) fn is_settled(&self) -> bool {
        lock(&self.0.pending).is_empty()
    }

    pub(super) fn reject(&self, rejected: RejectedWindow) {
        let cause = rejected.rejection.cause();
        let unlogged = match rejected.rejection {
            // At the end there is no later message that could count them; a queue bounds them.
            Rejection::Stopped | Rejection::NotStored { .. } => Some(0),
            _ => lock(&self.0.log_rate).should_log(cause, Instant::now()),
        };
        if let Some(unlogged) = unlogged {
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
