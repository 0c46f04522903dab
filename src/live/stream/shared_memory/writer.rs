//! The writing end of the sample stream, on the bus thread.

use core::time::Duration;
use std::time::Instant;

use didim_drivers::socket::monotonic_ns;
use didim_dynamics::sample::JointSample;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, ipc};
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::node::StreamNode;
use super::reader::{acknowledgement_service, notification_service, sample_service};
use crate::live::stream::message::{
    Acknowledgement, BATCH_SAMPLES, BatchKind, SampleBatch, StreamSample,
};
use crate::live::stream::{StreamError, options};

/// Pace of a stream. It determines which side waits for the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The bus does not wait. A reader that is too slow loses samples.
    Live,
    /// The log waits. The writer publishes no more than the reader's buffer can hold.
    Replay,
}

impl StreamNode {
    /// Creates the writing end of the samples. A cell has only one.
    ///
    /// # Errors
    /// [`StreamError::SharedMemoryFull`], [`StreamError::Service`], [`StreamError::Port`] (another
    /// acquisition runs), [`StreamError::Prefault`].
    pub fn sample_writer(&self, pace: Pace) -> Result<SampleWriter, StreamError> {
        self.check_room(self.options().samples_bytes())?;
        let writer = SampleWriter::new(self, pace)?;
        self.prefault()?;
        Ok(writer)
    }
}

/// The writing end. Each sample is written once, directly into the slot that the reader reads.
///
/// [`Self::write`] neither allocates nor locks, except for the first sample of a batch: the library
/// counts the references to a loaned slot in a heap block of 48 bytes.
#[derive(Debug)]
pub struct SampleWriter {
    filling_batch: Option<SampleMut<ipc::Service, SampleBatch, ()>>,
    filling_since: Instant,
    publisher: Publisher<ipc::Service, SampleBatch, ()>,
    notifier: Notifier<ipc::Service>,
    acknowledgements: Subscriber<ipc::Service, Acknowledgement, ()>,
    batches_acknowledged: u64,
    service: PortFactory<ipc::Service, SampleBatch, ()>,
    pace: Pace,
    max_age: Duration,
    /// Maximum number of unacknowledged batches in a replay.
    max_unacknowledged: u64,
    session: u64,
    batches_sent: u64,
    sample_rate_hz: f64,
    joints: u32,
}

impl SampleWriter {
    fn new(node: &StreamNode, pace: Pace) -> Result<Self, StreamError> {
        let options = node.options();
        let (name, service) = sample_service(node)?;
        let publisher = service
            .publisher_builder()
            .max_loaned_samples(options::MAX_LOANED)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| StreamError::port("publisher", &name, cause))?;
        let notifier = notification_service(node)?
            .notifier_builder()
            .create()
            .map_err(|cause| StreamError::port("notifier", &name, cause))?;
        let (name, acknowledgements) = acknowledgement_service(node)?;
        let acknowledgements = acknowledgements
            .subscriber_builder()
            .create()
            .map_err(|cause| StreamError::port("subscriber", &name, cause))?;
        let id = publisher.id().value();
        #[expect(clippy::cast_possible_truncation, reason = "both halves of the id are mixed")]
        let session = (id ^ (id >> 64)) as u64;
        Ok(Self {
            filling_batch: None,
            filling_since: Instant::now(),
            publisher,
            notifier,
            acknowledgements,
            batches_acknowledged: 0,
            service,
            pace,
            max_age: options.max_batch_age,
            max_unacknowledged: (options.buffer_batches() as u64 / 2).max(1),
            session,
            batches_sent: 0,
            sample_rate_hz: options.sample_rate_hz,
            joints: u32::try_from(options.joints).unwrap_or(0),
        })
    }

    /// Appends a sample, and sends the batch when it is full. `queue_drops` is the number of
    /// dropped frames at this sample, `now` is the time of the call, and `written_ns` is the
    /// writing time for the reader \[ns, CLOCK_BOOTTIME\].
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn write(
        &mut self,
        sample: &JointSample,
        queue_drops: u64,
        now: Instant,
        written_ns: u64,
    ) -> Result<(), StreamError> {
        let mut slot = match self.filling_batch.take() {
            Some(slot) => slot,
            None => self.begin(now)?,
        };
        let batch = slot.payload_mut();
        let index = usize::try_from(batch.count).unwrap_or(BATCH_SAMPLES);
        if let Some(place) = batch.slots.get_mut(index) {
            *place = StreamSample::new(sample, queue_drops, written_ns);
            batch.count += 1;
        }
        let full = batch.samples().len() == BATCH_SAMPLES;
        self.filling_batch = Some(slot);
        if full { self.send() } else { Ok(()) }
    }

    /// Returns the time until the batch being filled must be sent. `None` if no batch is being
    /// filled.
    pub fn due_in(&self, now: Instant) -> Option<Duration> {
        self.filling_batch.as_ref()?;
        Some((self.filling_since + self.max_age).saturating_duration_since(now))
    }

    /// Sends the batch being filled if it has reached its maximum age.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn send_if_due(&mut self, now: Instant) -> Result<(), StreamError> {
        if self.due_in(now) == Some(Duration::ZERO) { self.send() } else { Ok(()) }
    }

    /// Sends the remaining samples and the end mark.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn finish(&mut self) -> Result<(), StreamError> {
        self.send()?;
        let mut last = self.begin(Instant::now())?;
        last.payload_mut().kind = BatchKind::End.code();
        self.filling_batch = Some(last);
        self.send()
    }

    /// Returns true if another batch can be sent without a loss at the reader. On a live bus, this
    /// is always true. In a replay, a reader must be connected, and at most half a buffer of
    /// batches may be unacknowledged.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn has_room(&mut self) -> Result<bool, StreamError> {
        match self.pace {
            Pace::Live => Ok(true),
            Pace::Replay => {
                Ok(self.batches_in_flight()? < self.max_unacknowledged && self.readers() > 0)
            }
        }
    }

    /// Returns true if the reader has acknowledged all batches, including the end mark. On a live
    /// bus, a reader acknowledges only the end mark.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn is_drained(&mut self) -> Result<bool, StreamError> {
        Ok(self.batches_in_flight()? == 0)
    }

    /// Returns the number of batches that were sent and not acknowledged.
    fn batches_in_flight(&mut self) -> Result<u64, StreamError> {
        while let Some(news) = self
            .acknowledgements
            .receive()
            .map_err(|cause| StreamError::transport("receiving", "acknowledgements", cause))?
        {
            if news.session == self.session {
                self.batches_acknowledged = self.batches_acknowledged.max(news.batches);
            }
        }
        Ok(self.batches_sent.saturating_sub(self.batches_acknowledged))
    }

    /// Returns the number of connected readers, including dead ones that have not been noticed yet.
    pub fn readers(&self) -> usize {
        self.service.dynamic_config().number_of_subscribers()
    }

    /// Returns the number of batches sent.
    pub fn batches_sent(&self) -> u64 {
        self.batches_sent
    }

    fn begin(
        &mut self,
        now: Instant,
    ) -> Result<SampleMut<ipc::Service, SampleBatch, ()>, StreamError> {
        let mut slot = self
            .publisher
            .loan()
            .map_err(|cause| StreamError::transport("loaning", "samples", cause))?;
        let batch = slot.payload_mut();
        batch.session = self.session;
        batch.number = self.batches_sent;
        batch.sample_rate_hz = self.sample_rate_hz;
        batch.joints = self.joints;
        batch.kind = match self.pace {
            Pace::Live => BatchKind::Live.code(),
            Pace::Replay => BatchKind::Replay.code(),
        };
        self.filling_since = now;
        Ok(slot)
    }

    fn send(&mut self) -> Result<(), StreamError> {
        let Some(mut slot) = self.filling_batch.take() else {
            return Ok(());
        };
        slot.payload_mut().sent_ns = monotonic_ns();
        // An unreachable reader (it has just died, or its queue is broken) misses this batch, and
        // notices the gap in the batch numbers. The other readers receive the batch.
        slot.send().map_err(|cause| StreamError::transport("sending", "samples", cause))?;
        self.batches_sent += 1;
        // A listener with a full queue is already awake.
        let _ = self.notifier.notify();
        Ok(())
    }
}
