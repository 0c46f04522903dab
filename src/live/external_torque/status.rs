//! Counts of the observer thread, which other threads read without blocking it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::live::latency::{Latencies, LatencySummary};
use crate::live::stream::{ExternalTorqueMessage, MessageState};

/// Shared counts of the observer thread.
#[derive(Clone, Debug, Default)]
pub struct SharedExternalTorque(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    read_to_published: Latencies,
    published: AtomicU64,
    valid: AtomicU64,
    skipped: AtomicU64,
    clients: AtomicU64,
    messages_lost: AtomicU64,
    unpublished: AtomicU64,
    latest: Mutex<Option<ExternalTorqueMessage>>,
    model: Mutex<Model>,
}

/// State of the model, as the thread that reads results knows it.
#[derive(Clone, Debug, Default)]
struct Model {
    result: Option<String>,
    problem: Option<String>,
}

/// External torque of one joint, now.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTorque {
    /// Torque of the environment on the joint \[N·m or N\].
    pub value: f64,
    /// Its standard deviation.
    pub standard_deviation: f64,
}

/// External torque in a status snapshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ExternalTorqueStatus {
    /// The result of the model: its number, or the file that the cell names. `None` without one.
    pub result: Option<String>,
    /// Problem of the newest result or of the file. The model in use stays.
    pub problem: Option<String>,
    /// Number of published messages.
    pub published: u64,
    /// Number of messages with a usable torque.
    pub valid: u64,
    /// Number of samples that did not fit into the queue, because the thread got no processor.
    pub skipped: u64,
    /// Number of messages that could not be published in shared memory.
    pub unpublished: u64,
    /// Number of clients at the socket.
    pub clients: u64,
    /// Number of messages that clients of the socket lost because they were too slow.
    pub messages_lost: u64,
    /// Time from the reading of a sample's frames to the published message, since the start. It
    /// begins before the sample is in the buffer, and is therefore never too short.
    pub read_to_published: Option<LatencySummary>,
    /// Torque of each joint in the newest message if it is usable; `None` for a joint without a
    /// recorded torque. Empty if it is not usable.
    pub joints: Vec<Option<JointTorque>>,
}

impl SharedExternalTorque {
    pub(super) fn count_skipped(&self) {
        self.0.skipped.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_lost(&self) {
        self.0.messages_lost.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn set_clients(&self, count: usize) {
        self.0.clients.store(count as u64, Ordering::Relaxed);
    }

    pub(super) fn count_unpublished(&self) {
        self.0.unpublished.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a message that was published at `latency_ns` after the reading of its frames. A
    /// reader of the status does not block this call.
    pub(super) fn count_published(&self, message: &ExternalTorqueMessage, latency_ns: u64) {
        self.0.read_to_published.count_time(latency_ns);
        self.0.published.fetch_add(1, Ordering::Relaxed);
        if message.state == MessageState::Valid as u32 {
            self.0.valid.fetch_add(1, Ordering::Relaxed);
        }
        if let Ok(mut latest) = self.0.latest.try_lock() {
            *latest = Some(*message);
        }
    }

    /// Sets the result in use, or the problem of the newest one.
    pub(super) fn set_model(&self, outcome: Result<String, String>) {
        let mut model = self.0.model.lock().unwrap_or_else(PoisonError::into_inner);
        match outcome {
            Ok(result) => *model = Model { result: Some(result), problem: None },
            Err(problem) => model.problem = Some(problem),
        }
    }

    /// Reports that the observer thread panicked: nothing is published any more.
    pub fn report_panic(&self) {
        self.set_model(Err("the observer thread panicked; report the message in the log".into()));
    }

    /// Returns the status.
    pub fn snapshot(&self) -> ExternalTorqueStatus {
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
        let latest = *self.0.latest.lock().unwrap_or_else(PoisonError::into_inner);
        let model = self.0.model.lock().unwrap_or_else(PoisonError::into_inner).clone();
        ExternalTorqueStatus {
            result: model.result,
            problem: model.problem,
            published: count(&self.0.published),
            valid: count(&self.0.valid),
            skipped: count(&self.0.skipped),
            unpublished: count(&self.0.unpublished),
            clients: count(&self.0.clients),
            messages_lost: count(&self.0.messages_lost),
            read_to_published: self.0.read_to_published.summary(),
            joints: latest.as_ref().map_or_else(Vec::new, joint_torques),
        }
    }
}

/// Returns the torques of a usable message.
fn joint_torques(message: &ExternalTorqueMessage) -> Vec<Option<JointTorque>> {
    if message.state != MessageState::Valid as u32 {
        return Vec::new();
    }
    let values = message.torque.iter().zip(&message.standard_deviation);
    let joints = usize::try_from(message.joints).unwrap_or(0);
    values
        .take(joints)
        .map(|(value, standard_deviation)| {
            let torque = JointTorque { value: *value, standard_deviation: *standard_deviation };
            Some(torque).filter(|of| of.value.is_finite() && of.standard_deviation.is_finite())
        })
        .collect()
}
