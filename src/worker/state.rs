//! What the worker tells about itself.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use didim_core::identification::Estimate;
use serde::{Deserialize, Serialize};

use super::window::{RejectedWindow, Window};

/// Where the current window is.
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

/// The last estimate in a few words.
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
    /// Number of parameters.
    pub parameters: usize,
    /// ‖y − Xθ‖ / ‖y‖; nothing when it is not a number.
    pub relative_error: Option<f64>,
    /// Condition number; nothing when it is not finite.
    pub condition_number: Option<f64>,
    /// Whether it may be used.
    pub applicable: bool,
    /// Why not.
    pub reasons: Vec<String>,
}

impl EstimateSummary {
    pub(super) fn new(window: &Window, estimate: &Estimate) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        Self {
            window: window.number,
            first_sequence: window.first_sequence(),
            last_sequence: window.last_sequence(),
            method: estimate.method.clone(),
            parameters: estimate.parameters.len(),
            relative_error: finite(estimate.relative_error),
            condition_number: finite(estimate.condition_number),
            applicable: estimate.verdict.applicable,
            reasons: estimate.verdict.reasons.clone(),
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
    /// Batches that gave way in the buffer because the worker was too slow.
    pub batches_lost: u64,
    /// Times the acquisition was restarted under a running worker.
    pub restarts: u64,
    /// The current window.
    pub window: WindowState,
    /// Windows opened.
    pub windows_opened: u64,
    /// Windows identified, whatever the verdict.
    pub windows_identified: u64,
    /// Windows rejected, by cause.
    pub windows_rejected: BTreeMap<String, u64>,
    /// Windows waiting for the identification or in it.
    pub windows_pending: u64,
    /// The last rejection.
    pub last_rejection: Option<RejectedWindow>,
    /// The last estimate.
    pub last_estimate: Option<EstimateSummary>,
}

/// The counts, shared between the worker's threads and the status. The bus thread has no part in
/// it.
#[derive(Clone, Debug, Default)]
pub struct SharedEstimation(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    status: Mutex<EstimationStatus>,
    turns: AtomicU64,
}

impl SharedEstimation {
    /// A copy of the counts.
    pub fn snapshot(&self) -> EstimationStatus {
        self.update().clone()
    }

    /// Turns of the worker's loop: they go on as long as it is well, samples or not.
    pub fn turns(&self) -> u64 {
        self.0.turns.load(Ordering::Relaxed)
    }

    pub(super) fn turn(&self) {
        self.0.turns.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn update(&self) -> MutexGuard<'_, EstimationStatus> {
        // Whoever panicked left counts, not a broken structure.
        self.0.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn reject(&self, rejected: RejectedWindow) {
        tracing::warn!(
            window = rejected.number,
            first = rejected.first_sequence,
            last = rejected.last_sequence,
            "window rejected: {}",
            rejected.rejection
        );
        let mut status = self.update();
        let cause = rejected.rejection.cause().to_owned();
        *status.windows_rejected.entry(cause).or_default() += 1;
        status.last_rejection = Some(rejected);
    }
}
