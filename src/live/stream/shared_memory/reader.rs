//! The reading end of the sample stream.

use core::time::Duration;
use std::time::Instant;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::{event, publish_subscribe};

use super::node::StreamNode;
use crate::live::stream::message::{Acknowledgement, BatchKind, SampleBatch, StreamSample};
use crate::live::stream::{StreamError, options};

type SampleService = publish_subscribe::PortFactory<ipc::Service, SampleBatch, ()>;
type AcknowledgementService = publish_subscribe::PortFactory<ipc::Service, Acknowledgement, ()>;

/// Opens the sample service. The first caller creates it.
pub(super) fn sample_service(node: &StreamNode) -> Result<(String, SampleService), StreamError> {
    let (name, service) = node.service(options::SAMPLES_SERVICE)?;
    let service = node
        .node
        .service_builder(&service)
        .publish_subscribe::<SampleBatch>()
        .max_publishers(1)
        .max_subscribers(options::MAX_READERS)
        // A late reader starts with the next batch. With a history, a restarted worker would
        // identify the same window twice.
        .history_size(0)
        .subscriber_max_buffer_size(node.options().buffer_batches())
        .subscriber_max_borrowed_samples(options::MAX_BORROWED)
        .enable_safe_overflow(true)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))?;
    Ok((name, service))
}

/// Opens the event service, which sends an event after each batch.
pub(super) fn notification_service(
    node: &StreamNode,
) -> Result<event::PortFactory<ipc::Service>, StreamError> {
    let (name, service) = node.service(options::SAMPLES_SERVICE)?;
    node.node
        .service_builder(&service)
        .event()
        .max_notifiers(1)
        .max_listeners(options::MAX_READERS)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))
}

/// Opens the service through which the reader of a replay reports its progress.
pub(super) fn acknowledgement_service(
    node: &StreamNode,
) -> Result<(String, AcknowledgementService), StreamError> {
    let (name, service) = node.service(options::ACKNOWLEDGEMENTS_SERVICE)?;
    let service = node
        .node
        .service_builder(&service)
        .publish_subscribe::<Acknowledgement>()
        .max_publishers(options::MAX_READERS)
        .max_subscribers(1)
        .history_size(1)
        .subscriber_max_buffer_size(1)
        .enable_safe_overflow(true)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))?;
    Ok((name, service))
}

impl StreamNode {
    /// Creates a reading end of the samples. It receives the samples that are sent after its
    /// creation.
    ///
    /// # Errors
    /// [`StreamError::Service`], [`StreamError::Port`].
    pub fn sample_reader(self) -> Result<SampleReader, StreamError> {
        let reader = SampleReader::new(self)?;
        reader.node.prefault()?;
        Ok(reader)
    }
}

/// A reading end of the sample stream.
#[derive(Debug)]
pub struct SampleReader {
    subscriber: Subscriber<ipc::Service, SampleBatch, ()>,
    listener: Listener<ipc::Service>,
    acknowledgements: Publisher<ipc::Service, Acknowledgement, ()>,
    /// Session and number of the next expected batch.
    expected_batch: Option<(u64, u64)>,
    last_cleaned: Instant,
    node: StreamNode,
}

/// A batch in shared memory, with the losses before it.
#[derive(Debug)]
pub struct Batch {
    sample: Sample<ipc::Service, SampleBatch, ()>,
    /// Number of batches lost in the buffer since the previous batch because the reader was too
    /// slow.
    pub lost_batches: u64,
    /// True if the acquisition was restarted before this batch. Sequence numbers then restart.
    pub restarted: bool,
}

impl Batch {
    /// Returns the samples.
    pub fn samples(&self) -> &[StreamSample] {
        self.sample.payload().samples()
    }

    /// Returns the kind of the batch.
    pub fn kind(&self) -> BatchKind {
        self.sample.payload().kind()
    }

    /// Returns the time of sending \[ns, CLOCK_BOOTTIME\].
    pub fn sent_ns(&self) -> u64 {
        self.sample.payload().sent_ns
    }

    /// Returns the number of the batch in the session.
    pub fn number(&self) -> u64 {
        self.sample.payload().number
    }
}

impl SampleReader {
    fn new(node: StreamNode) -> Result<Self, StreamError> {
        let (name, acknowledgements) = acknowledgement_service(&node)?;
        let acknowledgements = acknowledgements
            .publisher_builder()
            .create()
            .map_err(|cause| StreamError::port("publisher", &name, cause))?;
        let (name, service) = sample_service(&node)?;
        let listener = notification_service(&node)?
            .listener_builder()
            .create()
            .map_err(|cause| StreamError::port("listener", &name, cause))?;
        // The subscriber is created last, because a replay begins as soon as a subscriber exists.
        let subscriber = service
            .subscriber_builder()
            .buffer_size(node.options().buffer_batches())
            .create()
            .map_err(|cause| StreamError::port("subscriber", &name, cause))?;
        Ok(Self {
            subscriber,
            listener,
            acknowledgements,
            expected_batch: None,
            last_cleaned: Instant::now(),
            node,
        })
    }

    /// Sleeps until a batch is announced, for at most `timeout`. If none is announced, searches for
    /// dead processes, at most once per [`options::DEAD_NODE_DEADLINE`]. A reader has no other way
    /// to notice them.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn wait_for_batch(&mut self, timeout: Duration) -> Result<(), StreamError> {
        let announced = match self.listener.timed_wait(|_| {}, timeout) {
            Ok(announced) => announced,
            // A stopped process that continues, a debugger, or a signal.
            Err(ListenerWaitError::InterruptSignal) => 0,
            Err(cause) => return Err(StreamError::transport("waiting", "samples", cause)),
        };
        if announced == 0 && self.last_cleaned.elapsed() >= options::DEAD_NODE_DEADLINE {
            self.node.clean_up_dead();
            self.last_cleaned = Instant::now();
        }
        Ok(())
    }

    /// Returns the next batch, if one is available.
    ///
    /// # Errors
    /// [`StreamError::Transport`]; [`StreamError::OtherCell`] if the samples are of another arm or
    /// rate than this end expects.
    pub fn receive(&mut self) -> Result<Option<Batch>, StreamError> {
        let received = self
            .subscriber
            .receive()
            .map_err(|cause| StreamError::transport("receiving", "samples", cause))?;
        let Some(sample) = received else {
            return Ok(None);
        };
        let batch = sample.payload();
        let ours = self.node.options();
        let our_joints = u32::try_from(ours.joints).unwrap_or(0);
        #[expect(clippy::float_cmp, reason = "both were read from the same digits of a file")]
        if batch.joints != our_joints || batch.sample_rate_hz != ours.sample_rate_hz {
            return Err(StreamError::OtherCell {
                their_joints: batch.joints,
                their_rate_hz: batch.sample_rate_hz,
                our_joints,
                our_rate_hz: ours.sample_rate_hz,
            });
        }
        let (lost_batches, restarted) = match self.expected_batch {
            Some((session, number)) if session == batch.session => {
                (batch.number.saturating_sub(number), false)
            }
            Some(_) => (batch.number, true),
            // Batches sent before this reader joined are not lost.
            None => (0, false),
        };
        self.expected_batch = Some((batch.session, batch.number + 1));
        Ok(Some(Batch { sample, lost_batches, restarted }))
    }

    /// Acknowledges to a replay that all received batches have been processed.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn acknowledge(&mut self) -> Result<(), StreamError> {
        let Some((session, batches)) = self.expected_batch else {
            return Ok(());
        };
        self.acknowledgements
            .send_copy(Acknowledgement { session, batches })
            .map(|_| ())
            .map_err(|cause| StreamError::transport("sending", "acknowledgements", cause))
    }
}
