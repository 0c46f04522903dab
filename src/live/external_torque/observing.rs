//! The observer thread.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;

use didim_drivers::socket::monotonic_ns;
use rtrb::Consumer;

use super::clients::Clients;
use super::models::{ModelQueue, ObserverModel};
use super::samples::ObservedSample;
use super::status::SharedExternalTorque;
use crate::live::stream::{
    ExternalTorqueMessage, ExternalTorqueWriter, StreamError, StreamNode, StreamOptions,
};

/// Longest sleep of the thread. It limits the time until the thread notices a stop.
const LONGEST_SLEEP: Duration = Duration::from_millis(20);

/// Parts of the thread, which other threads hand over.
#[derive(Debug)]
pub struct ObservingParts {
    /// Samples of the bus thread.
    pub samples: Consumer<ObservedSample>,
    /// Place for the thread, which the bus thread wakes.
    pub reader: Arc<OnceLock<Thread>>,
    /// New observers.
    pub models: ModelQueue,
    /// New clients.
    pub clients: Clients,
    /// Shared counts.
    pub shared: SharedExternalTorque,
}

/// The observer thread. It must run on the thread that created it. After its start it takes no
/// lock on which another thread could block it, logs nothing, and allocates no memory; the
/// stream's library allocates and frees 48 bytes per message.
#[derive(Debug)]
pub struct Observing {
    parts: ObservingParts,
    model: Option<ObserverModel>,
    writer: ExternalTorqueWriter,
    joints: usize,
    number: u64,
}

impl Observing {
    /// Creates the port.
    ///
    /// # Errors
    /// [`StreamError`].
    pub fn start(options: &StreamOptions, parts: ObservingParts) -> Result<Self, StreamError> {
        let writer = StreamNode::join(options)?.external_torque_writer()?;
        // The thread is stored once.
        let _ = parts.reader.set(std::thread::current());
        Ok(Self { parts, model: None, writer, joints: options.joints, number: 0 })
    }

    /// Publishes the external torque of every sample until `stop` is set.
    pub fn run(mut self, stop: &AtomicBool) {
        while !stop.load(Ordering::Relaxed) {
            self.step();
        }
    }

    /// Publishes the external torque of the next sample, or waits for one for at most 20 ms.
    /// Returns true if there was a sample.
    pub fn step(&mut self) -> bool {
        self.parts.clients.welcome(&self.parts.shared);
        let sample = self.parts.samples.pop();
        match &sample {
            Ok(sample) => {
                self.take_model();
                self.observe(sample);
            }
            // A sample that arrives now has stored a token, so that this returns at once.
            Err(_) => std::thread::park_timeout(LONGEST_SLEEP),
        }
        sample.is_ok()
    }

    /// Replaces the observer by one of a newer result.
    fn take_model(&mut self) {
        if let Ok(mut next) = self.parts.models.new.pop() {
            if let Some(mut earlier) = self.model.take() {
                next.observer.continue_from(&mut earlier.observer);
                // The other thread frees the memory. If it is late, this one does.
                let _ = self.parts.models.replaced.push(earlier);
            }
            self.model = Some(next);
        }
    }

    fn observe(&mut self, sample: &ObservedSample) {
        let joints = self.joints;
        let estimate = self.model.as_mut().and_then(|model| {
            let position = &sample.motor_position_rad[..joints];
            let torque = &sample.motor_torque_nm[..joints];
            model.observer.step(sample.sequence, position, torque)
        });
        let message = ExternalTorqueMessage {
            number: self.number,
            sequence: sample.sequence,
            stamp_ns: sample.stamp_ns,
            ..ExternalTorqueMessage::default()
        };
        let mut message = message.with_estimate(estimate, joints);
        message.result = self.model.as_ref().map_or(0, |model| model.result);
        message.published_ns = monotonic_ns();
        self.number += 1;
        if self.writer.publish(&message).is_err() {
            self.parts.shared.count_unpublished();
        }
        let latency_ns = monotonic_ns().saturating_sub(sample.read_ns);
        self.parts.shared.count_published(&message, latency_ns);
        if !self.parts.clients.is_empty() {
            self.parts.clients.send(&message.to_bytes(), &self.parts.shared);
        }
    }
}
