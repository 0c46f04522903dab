//! The bus thread's loop.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use didim_drivers::assemble::Assembler;
use didim_drivers::samples::{Assembled, Samples, Tap};
use didim_drivers::socket::monotonic_ns;
use didim_drivers::source::{Received, Source, SourceError, StampClock};

use super::counts::{AcquisitionCounts, BusState, FrameTime};
use super::state::SharedAcquisition;
use crate::live::external_torque::SampleTap;
use crate::live::real_time_options::RealTimeOptions;
use crate::live::recording::FrameTap;
use crate::live::stream::{Pace, SampleWriter, StreamError, StreamNode, StreamOptions};

/// Longest wait for a frame. It limits the time until the thread notices a stop.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// Interval at which a replay checks whether the reader has capacity again.
const CAPACITY_POLL: Duration = Duration::from_micros(200);
/// Interval at which the counts are published.
const PUBLISH_INTERVAL: Duration = Duration::from_millis(50);
/// Maximum time that the thread waits for the readers at the end of a live bus.
const FINAL_READ_TIMEOUT: Duration = Duration::from_secs(2);
/// Maximum number of frames taken from the source at a time. It limits how far a replay can exceed
/// the capacity of the reader.
const BATCH_FRAMES: usize = 256;

/// Options of the bus thread.
#[derive(Clone, Debug, PartialEq)]
pub struct AcquireOptions {
    /// Options of the stream.
    pub stream: StreamOptions,
    /// Pace of the stream, with or without waiting for the reader.
    pub pace: Pace,
    /// Real-time priority and processor.
    pub real_time: RealTimeOptions,
    /// Time without a frame after which the bus is silent.
    pub silence_after: Duration,
}

/// Error that ends the bus thread early.
#[derive(Debug, thiserror::Error)]
pub enum AcquireError {
    /// The stream failed.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The source failed permanently, or a log has an unreadable line. The rest of such a log would
    /// not be a true replay.
    #[error(transparent)]
    Source(#[from] SourceError),
}

/// Reason for the end of the bus thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcquireEnd {
    /// A stop was requested.
    Stopped,
    /// The log has ended, or every sender of an in-process bus is closed.
    SourceEnded,
}

/// State of the bus thread. It stays on the thread that created it.
pub struct Acquisition {
    samples: Samples<'static>,
    writer: SampleWriter,
    /// Times of the frames that completed the samples read together, one per sample \[ns,
    /// CLOCK_BOOTTIME\]. The vector is empty between two steps. It is reused to avoid allocations.
    completed_ns: Vec<u64>,
    pace: Pace,
    silence_after: Duration,
    /// Samples for the observer thread.
    observer: Option<SampleTap>,
    counts: AcquisitionCounts,
    shared: SharedAcquisition,
    last_frame: Instant,
    last_published: Instant,
}

impl Acquisition {
    /// Creates the ports, and then requests the priority and the processor.
    ///
    /// # Errors
    /// [`AcquireError::Stream`].
    pub fn start(
        options: &AcquireOptions,
        source: Box<dyn Source>,
        assembler: Assembler,
        shared: &SharedAcquisition,
    ) -> Result<Self, AcquireError> {
        let writer = StreamNode::join(&options.stream)?.sample_writer(options.pace)?;
        shared.set_grants(options.real_time.apply());
        shared.set_interfaces(source.interfaces());
        let frame_time = match source.stamp_clock() {
            StampClock::Realtime => FrameTime::Stamp,
            StampClock::Bus | StampClock::Own => FrameTime::Read,
        };
        let counts = AcquisitionCounts { frame_time, ..AcquisitionCounts::default() };
        // The initial counts are published before the first latency.
        shared.publish(&counts);
        let now = Instant::now();
        Ok(Self {
            samples: Samples::new(source, assembler, BATCH_FRAMES),
            writer,
            completed_ns: Vec::with_capacity(BATCH_FRAMES),
            pace: options.pace,
            silence_after: options.silence_after,
            observer: None,
            counts,
            shared: shared.clone(),
            last_frame: now,
            last_published: now,
        })
    }

    /// Passes every frame to a recorder, with the stamp that the assembler gets.
    #[must_use]
    pub fn with_tap(self, tap: Option<FrameTap>) -> Self {
        let tap = tap.map(|mut tap| -> Tap<'static> {
            Box::new(move |frames, drops| tap.pass_on(frames, drops))
        });
        Self { samples: self.samples.with_tap(tap), ..self }
    }

    /// Passes every sample to an observer of external torque.
    #[must_use]
    pub fn with_observer(self, observer: Option<SampleTap>) -> Self {
        Self { observer, ..self }
    }

    /// Reads the bus until `stop` is set or the source ends.
    ///
    /// # Errors
    /// [`AcquireError`].
    pub fn run(mut self, stop: &AtomicBool) -> Result<AcquireEnd, AcquireError> {
        let end = loop {
            if stop.load(Ordering::Relaxed) {
                break Ok(AcquireEnd::Stopped);
            }
            match self.step() {
                Ok(None) => {}
                Ok(Some(end)) => break self.finish(stop).map(|()| end),
                Err(error) => break Err(error),
            }
        };
        if end.is_err() {
            self.counts.bus = BusState::Down;
        }
        self.count();
        self.shared.publish(&self.counts);
        end
    }

    /// Runs one step, which waits at most once and at most 20 ms. Returns `None` until the source
    /// ends.
    ///
    /// # Errors
    /// [`AcquireError`].
    pub fn step(&mut self) -> Result<Option<AcquireEnd>, AcquireError> {
        self.counts.iterations += 1;
        if !self.writer.has_room()? {
            std::thread::sleep(CAPACITY_POLL);
            self.publish_if_due(Instant::now());
            return Ok(None);
        }
        let before = Instant::now();
        let wait = self.writer.due_in(before).unwrap_or(LONGEST_WAIT).min(LONGEST_WAIT);
        let received = self.samples.read(wait);
        let now = Instant::now();
        match received {
            Ok(Received::Frames) => {
                self.last_frame = now;
                self.counts.bus = BusState::Ok;
                self.write_samples(now)?;
            }
            Ok(Received::Silence) => {
                if now - self.last_frame >= self.silence_after {
                    self.counts.bus = self.state_in_silence();
                }
                self.write_samples(now)?;
            }
            Ok(Received::End) => return Ok(Some(AcquireEnd::SourceEnded)),
            Err(error) if self.pace == Pace::Live && error.is_recoverable() => {
                self.counts.source_failures += 1;
                self.counts.bus = BusState::Down;
                // A source that fails immediately must not cause a loop without pauses.
                std::thread::sleep(LONGEST_WAIT.saturating_sub(now - before));
            }
            Err(error) => return Err(error.into()),
        }
        self.writer.send_if_due(now)?;
        self.publish_if_due(now);
        Ok(None)
    }

    /// Returns the state of a bus that has been silent for long.
    fn state_in_silence(&self) -> BusState {
        match self.counts.bus {
            BusState::Ok => BusState::Silent,
            // The interface is up again.
            BusState::Down if self.samples.interface_faults().is_empty() => {
                match self.samples.counters().frames {
                    0 => BusState::Waiting,
                    _ => BusState::Silent,
                }
            }
            state => state,
        }
    }

    fn publish_if_due(&mut self, now: Instant) {
        if now - self.last_published >= PUBLISH_INTERVAL {
            self.last_published = now;
            self.count();
            self.shared.try_publish(&self.counts);
        }
    }

    /// Writes the samples of the received frames.
    fn write_samples(&mut self, now: Instant) -> Result<(), AcquireError> {
        let (read_ns, drops) = (self.samples.read_ns(), self.samples.counters().queue_drops);
        // On some systems, reading the clock is a system call. One call per sample would cost more
        // than the sample. Therefore, the worker gets a time before the writing of all samples read
        // together, and this code takes the time after it. Both latencies are too long by the
        // writing time, and never too short.
        while let Some(Assembled { sample, completed_ns }) = self.samples.poll() {
            if let Some(observer) = &mut self.observer {
                observer.pass_on(&sample, read_ns);
            }
            self.writer.write(&sample, drops, now, read_ns)?;
            self.counts.readings.update(&sample.readings);
            self.completed_ns.extend(completed_ns);
        }
        if let Some(observer) = &mut self.observer {
            observer.wake();
        }
        if !self.completed_ns.is_empty() {
            let written_ns = monotonic_ns();
            for completed_ns in self.completed_ns.drain(..) {
                self.shared.record_frame_to_buffer(written_ns.saturating_sub(completed_ns));
            }
        }
        Ok(())
    }

    /// Writes the sample of the last cycle, and ends the stream.
    fn finish(&mut self, stop: &AtomicBool) -> Result<(), AcquireError> {
        let now = Instant::now();
        self.write_samples(now)?;
        self.writer.finish()?;
        self.counts.bus = BusState::Ended;
        self.count();
        self.shared.try_publish(&self.counts);
        // The buffer exists only while its writer exists.
        while !stop.load(Ordering::Relaxed) && !self.writer.is_drained()? {
            if self.pace == Pace::Live
                && (self.writer.readers() == 0 || now.elapsed() > FINAL_READ_TIMEOUT)
            {
                break;
            }
            std::thread::sleep(CAPACITY_POLL);
            self.counts.iterations += 1;
            self.publish_if_due(Instant::now());
        }
        Ok(())
    }

    fn count(&mut self) {
        self.counts.source = self.samples.counters();
        self.counts.interface_faults = self.samples.interface_faults();
        self.counts.receive_buffer_bytes = self.samples.receive_buffer_bytes();
        if self.counts.source.stamped_late > 0 {
            self.counts.frame_time = FrameTime::Read;
        }
        self.counts.losses = *self.samples.losses();
        if let Some(counters) = self.samples.clock_counters() {
            self.counts.clock = counters;
        }
        self.counts.batches = self.writer.batches_sent();
    }
}
