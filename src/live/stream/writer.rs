//! The bus thread's end of the sample stream.

use core::time::Duration;
use std::time::Instant;

use didim_core::sample::JointSample;
use didim_drivers::socket::monotonic_ns;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, ipc};
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::message::{Acknowledgement, BATCH_SAMPLES, BatchKind, SampleBatch, StreamSample};
use super::node::StreamNode;
use super::reader::{acknowledgement_service, notification_service, sample_service};
use super::{StreamError, options};

/// Who waits for whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The bus does not wait: a reader that is too slow loses samples.
    Live,
    /// The log waits: nothing is published that the reader has no room for.
    Replay,
}

impl StreamNode {
    /// The writing end of the samples; a cell has one.
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

/// The writing end. Each sample is written once, into the slot that the reader will read.
///
/// [`Self::write`] neither allocates nor locks, but for the first sample of a batch: the library
/// counts the references to a loaned slot in a block of 48 bytes from the heap.
#[derive(Debug)]
pub struct SampleWriter {
    filling: Option<SampleMut<ipc::Service, SampleBatch, ()>>,
    filling_since: Instant,
    publisher: Publisher<ipc::Service, SampleBatch, ()>,
    notifier: Notifier<ipc::Service>,
    acknowledgements: Subscriber<ipc::Service, Acknowledgement, ()>,
    acknowledged: u64,
    service: PortFactory<ipc::Service, SampleBatch, ()>,
    pace: Pace,
    max_age: Duration,
    /// In a replay, batches that may be under way.
    allowance: u64,
    session: u64,
    sent: u64,
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
            filling: None,
            filling_since: Instant::now(),
            publisher,
            notifier,
            acknowledgements,
            acknowledged: 0,
            service,
            pace,
            max_age: options.max_batch_age,
            allowance: (options.buffer_batches() as u64 / 2).max(1),
            session,
            sent: 0,
            sample_rate_hz: options.sample_rate_hz,
            joints: u32::try_from(options.joints).unwrap_or(0),
        })
    }

    /// Appends a sample; sends the batch when it is full. `queue_drops` is the source's count at
    /// this sample, `now` the time of the call, and `written_ns` what the reader is told of it \[ns,
    /// CLOCK_MONOTONIC\].
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
        let mut slot = match self.filling.take() {
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
        self.filling = Some(slot);
        if full { self.send() } else { Ok(()) }
    }

    /// How long until the batch being filled must be sent; nothing when there is none.
    pub fn due_in(&self, now: Instant) -> Option<Duration> {
        self.filling.as_ref()?;
        Some((self.filling_since + self.max_age).saturating_duration_since(now))
    }

    /// Sends the batch being filled if it has come of age.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn send_if_due(&mut self, now: Instant) -> Result<(), StreamError> {
        if self.due_in(now) == Some(Duration::ZERO) { self.send() } else { Ok(()) }
    }

    /// Sends what is left and the mark that nothing follows.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn finish(&mut self) -> Result<(), StreamError> {
        self.send()?;
        let mut last = self.begin(Instant::now())?;
        last.payload_mut().kind = BatchKind::End.code();
        self.filling = Some(last);
        self.send()
    }

    /// Whether a further batch can be sent without the reader losing one: always on a living bus;
    /// in a replay when a reader is there and has acknowledged all but half a buffer.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn has_room(&mut self) -> Result<bool, StreamError> {
        match self.pace {
            Pace::Live => Ok(true),
            Pace::Replay => Ok(self.under_way()? < self.allowance && self.readers() > 0),
        }
    }

    /// Whether the reader has acknowledged everything that was sent, the end included. On a living
    /// bus a reader acknowledges the end only.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn is_drained(&mut self) -> Result<bool, StreamError> {
        Ok(self.under_way()? == 0)
    }

    /// Batches sent and not acknowledged.
    fn under_way(&mut self) -> Result<u64, StreamError> {
        while let Some(news) = self
            .acknowledgements
            .receive()
            .map_err(|cause| StreamError::transport("receiving", "acknowledgements", cause))?
        {
            if news.session == self.session {
                self.acknowledged = self.acknowledged.max(news.batches);
            }
        }
        Ok(self.sent.saturating_sub(self.acknowledged))
    }

    /// Readers that are connected or have died unnoticed.
    pub fn readers(&self) -> usize {
        self.service.dynamic_config().number_of_subscribers()
    }

    /// Batches sent.
    pub fn batches_sent(&self) -> u64 {
        self.sent
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
        batch.number = self.sent;
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
        let Some(mut slot) = self.filling.take() else {
            return Ok(());
        };
        slot.payload_mut().sent_ns = monotonic_ns();
        // A reader that cannot be reached (just died, or its queue is broken) is its own loss: the
        // batch number shows it, and the others have the batch.
        slot.send().map_err(|cause| StreamError::transport("sending", "samples", cause))?;
        self.sent += 1;
        // A listener whose queue is full is awake already.
        let _ = self.notifier.notify();
        Ok(())
    }
}
