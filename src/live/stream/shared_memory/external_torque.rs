//! External torques, one message per sample, each with a notification.

use core::time::Duration;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, ipc};
use iceoryx2::service::port_factory::{event, publish_subscribe};

use super::node::StreamNode;
use crate::live::stream::options::{
    EXTERNAL_TORQUE_BUFFER, EXTERNAL_TORQUE_SERVICE, EXTERNAL_TORQUE_WRITER_BYTES,
    MAX_EXTERNAL_TORQUE_READERS,
};
use crate::live::stream::{ExternalTorqueMessage, StreamError};

type TorqueService = publish_subscribe::PortFactory<ipc::Service, ExternalTorqueMessage, ()>;

fn service(node: &StreamNode) -> Result<(String, TorqueService), StreamError> {
    let (name, service) = node.service(EXTERNAL_TORQUE_SERVICE)?;
    let service = node
        .node
        .service_builder(&service)
        .publish_subscribe::<ExternalTorqueMessage>()
        .max_publishers(1)
        .max_subscribers(MAX_EXTERNAL_TORQUE_READERS)
        .history_size(0)
        .subscriber_max_buffer_size(EXTERNAL_TORQUE_BUFFER)
        .subscriber_max_borrowed_samples(1)
        .enable_safe_overflow(true)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))?;
    Ok((name, service))
}

fn notifications(node: &StreamNode) -> Result<event::PortFactory<ipc::Service>, StreamError> {
    let (name, service) = node.service(EXTERNAL_TORQUE_SERVICE)?;
    node.node
        .service_builder(&service)
        .event()
        .max_notifiers(1)
        .max_listeners(MAX_EXTERNAL_TORQUE_READERS)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))
}

impl StreamNode {
    /// Creates the writing end of the external torques. A cell has only one.
    ///
    /// # Errors
    /// The same as [`Self::sample_writer`].
    pub fn external_torque_writer(&self) -> Result<ExternalTorqueWriter, StreamError> {
        self.check_room(EXTERNAL_TORQUE_WRITER_BYTES)?;
        let writer = ExternalTorqueWriter::new(self)?;
        self.prefault()?;
        Ok(writer)
    }

    /// Creates a reading end of the external torques.
    ///
    /// # Errors
    /// The same as [`Self::sample_reader`].
    pub fn external_torque_reader(&self) -> Result<ExternalTorqueReader, StreamError> {
        let (name, service) = service(self)?;
        let listener = notifications(self)?
            .listener_builder()
            .create()
            .map_err(|cause| StreamError::port("listener", &name, cause))?;
        let subscriber = service
            .subscriber_builder()
            .create()
            .map_err(|cause| StreamError::port("subscriber", &name, cause))?;
        Ok(ExternalTorqueReader { subscriber, listener })
    }
}

/// The writing end. It never waits for a reader.
#[derive(Debug)]
pub struct ExternalTorqueWriter {
    publisher: Publisher<ipc::Service, ExternalTorqueMessage, ()>,
    notifier: Notifier<ipc::Service>,
}

impl ExternalTorqueWriter {
    fn new(node: &StreamNode) -> Result<Self, StreamError> {
        let (name, service) = service(node)?;
        let publisher = service
            .publisher_builder()
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| StreamError::port("publisher", &name, cause))?;
        let notifier = notifications(node)?
            .notifier_builder()
            .create()
            .map_err(|cause| StreamError::port("notifier", &name, cause))?;
        Ok(Self { publisher, notifier })
    }

    /// Publishes a message.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn publish(&mut self, message: &ExternalTorqueMessage) -> Result<(), StreamError> {
        self.publisher
            .send_copy(*message)
            .map_err(|cause| StreamError::transport("sending", EXTERNAL_TORQUE_SERVICE, cause))?;
        // A listener with a full queue is already awake.
        let _ = self.notifier.notify();
        Ok(())
    }
}

/// A reading end. A reader that is too slow loses the oldest messages.
#[derive(Debug)]
pub struct ExternalTorqueReader {
    subscriber: Subscriber<ipc::Service, ExternalTorqueMessage, ()>,
    listener: Listener<ipc::Service>,
}

impl ExternalTorqueReader {
    /// Sleeps until a message is announced, for at most `timeout`.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn wait(&mut self, timeout: Duration) -> Result<(), StreamError> {
        match self.listener.timed_wait(|_| {}, timeout) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(cause) => Err(StreamError::transport("waiting", EXTERNAL_TORQUE_SERVICE, cause)),
        }
    }

    /// Returns the next waiting message.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn receive(&mut self) -> Result<Option<ExternalTorqueMessage>, StreamError> {
        let received = self
            .subscriber
            .receive()
            .map_err(|cause| StreamError::transport("receiving", EXTERNAL_TORQUE_SERVICE, cause))?;
        Ok(received.map(|sample| *sample.payload()))
    }
}
