//! The other end of the sample stream.

use core::time::Duration;
use std::time::Instant;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::{event, publish_subscribe};

use super::message::{Acknowledgement, BatchKind, SampleBatch, StreamSample};
use super::node::StreamNode;
use super::{StreamError, options};

type SampleService = publish_subscribe::PortFactory<ipc::Service, SampleBatch, ()>;
type AcknowledgementService = publish_subscribe::PortFactory<ipc::Service, Acknowledgement, ()>;

/// The sample service, made by whoever comes first.
pub(super) fn sample_service(node: &StreamNode) -> Result<(String, SampleService), StreamError> {
    let (name, service) = node.service(options::SAMPLES)?;
    let service = node
        .node
        .service_builder(&service)
        .publish_subscribe::<SampleBatch>()
        .max_publishers(1)
        .max_subscribers(options::MAX_READERS)
        // A late reader starts with the next batch: with a history, a restarted worker would
        // identify the same window again.
        .history_size(0)
        .subscriber_max_buffer_size(node.options().buffer_batches())
        .subscriber_max_borrowed_samples(options::MAX_BORROWED)
        .enable_safe_overflow(true)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))?;
    Ok((name, service))
}

/// The event that follows each batch.
pub(super) fn notification_service(
    node: &StreamNode,
) -> Result<event::PortFactory<ipc::Service>, StreamError> {
    let (name, service) = node.service(options::SAMPLES)?;
    node.node
        .service_builder(&service)
        .event()
        .max_notifiers(1)
        .max_listeners(options::MAX_READERS)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))
}

/// How the reader of a replay says how far it is.
pub(super) fn acknowledgement_service(
    node: &StreamNode,
) -> Result<(String, AcknowledgementService), StreamError> {
    let (name, service) = node.service(options::ACKNOWLEDGEMENTS)?;
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
    /// A reading end of the samples. It sees what is sent from now on.
    ///
    /// # Errors
    /// [`StreamError::Service`], [`StreamError::Port`].
    pub fn sample_reader(self) -> Result<SampleReader, StreamError> {
        let reader = SampleReader::new(self)?;
        reader.node.prefault()?;
        Ok(reader)
    }
}

/// A reading end.
#[derive(Debug)]
pub struct SampleReader {
    subscriber: Subscriber<ipc::Service, SampleBatch, ()>,
    listener: Listener<ipc::Service>,
    acknowledgements: Publisher<ipc::Service, Acknowledgement, ()>,
    /// Session and number of the batch that should come next.
    expected: Option<(u64, u64)>,
    last_cleaned: Instant,
    node: StreamNode,
}

/// A batch as it lies in shared memory, with what happened before it.
#[derive(Debug)]
pub struct Batch {
    sample: Sample<ipc::Service, SampleBatch, ()>,
    /// Batches lost in the buffer since the one before: the reader was too slow.
    pub lost_batches: u64,
    /// The acquisition was restarted before this batch: sequence numbers begin anew.
    pub restarted: bool,
}

impl Batch {
    /// The samples.
    pub fn samples(&self) -> &[StreamSample] {
        self.sample.payload().samples()
    }

    /// What the batch is for.
    pub fn kind(&self) -> BatchKind {
        self.sample.payload().kind()
    }

    /// When it was sent \[ns, CLOCK_MONOTONIC\].
    pub fn sent_ns(&self) -> u64 {
        self.sample.payload().sent_ns
    }

    /// Its number in the session.
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
        // Last, because a replay begins as soon as it sees a subscriber.
        let subscriber = service
            .subscriber_builder()
            .buffer_size(node.options().buffer_batches())
            .create()
            .map_err(|cause| StreamError::port("subscriber", &name, cause))?;
        Ok(Self {
            subscriber,
            listener,
            acknowledgements,
            expected: None,
            last_cleaned: Instant::now(),
            node,
        })
    }

    /// Sleeps until a batch is announced, at most `timeout`. When nothing is, looks for processes
    /// that died, at most once a [`options::DEAD_NODE_DEADLINE`]: nobody else tells a reader.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn wait(&mut self, timeout: Duration) -> Result<(), StreamError> {
        let announced = self
            .listener
            .timed_wait(|_| {}, timeout)
            .map_err(|cause| StreamError::transport("waiting", "samples", cause))?;
        if announced == 0 && self.last_cleaned.elapsed() >= options::DEAD_NODE_DEADLINE {
            self.node.clean_up_dead();
            self.last_cleaned = Instant::now();
        }
        Ok(())
    }

    /// The next batch, if one is there.
    ///
    /// # Errors
    /// [`StreamError::Transport`]; [`StreamError::OtherCell`] when the samples are of another arm
    /// or rate than this end expects.
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
        let (lost_batches, restarted) = match self.expected {
            Some((session, number)) if session == batch.session => {
                (batch.number.saturating_sub(number), false)
            }
            Some(_) => (batch.number, true),
            // Whatever was sent before this reader came is not its loss.
            None => (0, false),
        };
        self.expected = Some((batch.session, batch.number + 1));
        Ok(Some(Batch { sample, lost_batches, restarted }))
    }

    /// Tells a replay that everything received so far is dealt with.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn acknowledge(&mut self) -> Result<(), StreamError> {
        let Some((session, batches)) = self.expected else {
            return Ok(());
        };
        self.acknowledgements
            .send_copy(Acknowledgement { session, batches })
            .map(|_| ())
            .map_err(|cause| StreamError::transport("sending", "acknowledgements", cause))
    }
}
