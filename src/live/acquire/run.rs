//! The bus thread's loop.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use didim_drivers::assemble::Assembler;
use didim_drivers::clock::ClockMap;
use didim_drivers::frame::Frame;
use didim_drivers::socket::{clock_pair, monotonic_ns};
use didim_drivers::source::{Received, Source, SourceError, StampClock};

use super::counts::{AcquisitionCounts, BusState, FrameTime};
use super::real_time::RealTimeOptions;
use super::state::SharedAcquisition;
use crate::live::recording::FrameTap;
use crate::live::stream::{Pace, SampleWriter, StreamError, StreamNode, StreamOptions};

/// The longest the thread waits for a frame, and so the longest it takes to see a stop.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// How often a replay looks whether the reader has room again.
const ROOM_POLL: Duration = Duration::from_micros(200);
/// How often the counts are left for others.
const PUBLISH_EVERY: Duration = Duration::from_millis(50);
/// How long the end of a living bus waits for its readers to have read it.
const LAST_READ: Duration = Duration::from_secs(2);
/// Frames taken from the source at a time. Bounds what a replay can overshoot its reader's room by.
const BATCH_FRAMES: usize = 256;

/// What the bus thread needs.
#[derive(Clone, Debug, PartialEq)]
pub struct AcquireOptions {
    /// The stream.
    pub stream: StreamOptions,
    /// Whether the reader is waited for.
    pub pace: Pace,
    /// Priority and processor.
    pub real_time: RealTimeOptions,
    /// A bus without a frame for this long is silent.
    pub silence_after: Duration,
}

/// Why the bus thread ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum AcquireError {
    /// The stream failed.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The source failed for good, or a log has a line that cannot be read: a replay of the rest
    /// would not be a replay.
    #[error(transparent)]
    Source(#[from] SourceError),
}

/// How the bus thread ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcquireEnd {
    /// It was told to.
    Stopped,
    /// The log is at its end, or every sender of an in-process bus is gone.
    SourceEnded,
}

/// The bus thread's state. It stays on the thread that made it.
pub struct Acquisition {
    source: Box<dyn Source>,
    assembler: Assembler,
    writer: SampleWriter,
    /// Maps stamps of CLOCK_REALTIME; nothing when the source has a clock of its own.
    clock: Option<ClockMap>,
    batch: Vec<Frame>,
    /// Of each sample of the batch, the time of the frame that completed it \[ns, CLOCK_MONOTONIC\].
    /// Empty between two turns, and kept for its memory.
    completed_ns: Vec<u64>,
    pace: Pace,
    silence_after: Duration,
    counts: AcquisitionCounts,
    shared: SharedAcquisition,
    /// Where frames are recorded.
    tap: Option<FrameTap>,
    last_frame: Instant,
    last_published: Instant,
}

impl Acquisition {
    /// Makes the ports, then asks for priority and processor.
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
        let clock = match source.stamp_clock() {
            StampClock::Realtime => Some(ClockMap::new(clock_pair())),
            StampClock::Own => None,
        };
        let frame_time = if clock.is_some() { FrameTime::Stamp } else { FrameTime::Read };
        let counts = AcquisitionCounts { frame_time, ..AcquisitionCounts::default() };
        // Before the first latency, what it begins with.
        shared.publish(&counts);
        let now = Instant::now();
        Ok(Self {
            source,
            assembler,
            writer,
            clock,
            batch: Vec::with_capacity(BATCH_FRAMES),
            completed_ns: Vec::with_capacity(BATCH_FRAMES),
            pace: options.pace,
            silence_after: options.silence_after,
            counts,
            shared: shared.clone(),
            tap: None,
            last_frame: now,
            last_published: now,
        })
    }

    /// Hands every frame to a recorder, with the stamp that the assembler sees.
    #[must_use]
    pub fn with_tap(self, tap: Option<FrameTap>) -> Self {
        Self { tap, ..self }
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

    /// One turn: at most one wait, of at most 20 ms. Nothing until the source ends.
    ///
    /// # Errors
    /// [`AcquireError`].
    pub fn step(&mut self) -> Result<Option<AcquireEnd>, AcquireError> {
        self.counts.turns += 1;
        if !self.writer.has_room()? {
            std::thread::sleep(ROOM_POLL);
            self.publish_if_due(Instant::now());
            return Ok(None);
        }
        let before = Instant::now();
        let wait = self.writer.due_in(before).unwrap_or(LONGEST_WAIT).min(LONGEST_WAIT);
        self.batch.clear();
        let received = self.source.receive(&mut self.batch, wait);
        let now = Instant::now();
        match received {
            Ok(Received::Frames) => self.take_frames(now)?,
            Ok(Received::Silence) => self.take_silence(now)?,
            Ok(Received::End) => return Ok(Some(AcquireEnd::SourceEnded)),
            Err(error) if self.pace == Pace::Live && error.is_recoverable() => {
                self.counts.source_failures += 1;
                self.counts.bus = BusState::Down;
                // A source that fails at once must not spin.
                std::thread::sleep(LONGEST_WAIT.saturating_sub(now - before));
            }
            Err(error) => return Err(error.into()),
        }
        self.writer.send_if_due(now)?;
        self.publish_if_due(now);
        Ok(None)
    }

    fn publish_if_due(&mut self, now: Instant) {
        if now - self.last_published >= PUBLISH_EVERY {
            self.last_published = now;
            self.count();
            self.shared.try_publish(&self.counts);
        }
    }

    fn take_frames(&mut self, now: Instant) -> Result<(), AcquireError> {
        self.last_frame = now;
        self.counts.bus = BusState::Ok;
        let read_ns = if let Some(clock) = &mut self.clock {
            let pair = clock_pair();
            clock.handle_pair(pair);
            for frame in &mut self.batch {
                frame.stamp_ns = clock.map(frame.stamp_ns);
            }
            pair.monotonic_ns
        } else {
            monotonic_ns()
        };
        let is_stamped = self.clock.is_some();
        let drops = self.source.counters().queue_drops;
        if let Some(tap) = &mut self.tap {
            tap.take(&self.batch, drops);
        }
        // Where a clock is a system call, a reading for each sample would cost more than the sample:
        // the worker is told of a time before all that was read together, and the time after all of
        // it is counted here. Either latency is too long by what writing takes, and never too short.
        for frame in &self.batch {
            self.assembler.handle_frame(frame);
            while let Some(sample) = self.assembler.poll_sample() {
                self.writer.write(&sample, drops, now, read_ns)?;
                self.completed_ns.push(if is_stamped { frame.stamp_ns } else { read_ns });
            }
        }
        if !self.completed_ns.is_empty() {
            let written_ns = monotonic_ns();
            for completed_ns in self.completed_ns.drain(..) {
                self.shared.record_frame_to_buffer(written_ns.saturating_sub(completed_ns));
            }
        }
        Ok(())
    }

    fn take_silence(&mut self, now: Instant) -> Result<(), AcquireError> {
        if now - self.last_frame >= self.silence_after && self.counts.bus == BusState::Ok {
            self.counts.bus = BusState::Silent;
        }
        // Only a clock that we can read tells how late it is; a log's time is that of its frames.
        if self.clock.is_none() {
            return Ok(());
        }
        self.assembler.handle_timeout(clock_pair().monotonic_ns);
        self.drain(now)
    }

    fn drain(&mut self, now: Instant) -> Result<(), AcquireError> {
        let drops = self.source.counters().queue_drops;
        while let Some(sample) = self.assembler.poll_sample() {
            self.writer.write(&sample, drops, now, monotonic_ns())?;
        }
        Ok(())
    }

    /// Lets the assembler decide about its last cycle, and ends the stream.
    fn finish(&mut self, stop: &AtomicBool) -> Result<(), AcquireError> {
        let now = Instant::now();
        self.assembler.handle_timeout(u64::MAX);
        self.drain(now)?;
        self.writer.finish()?;
        self.counts.bus = BusState::Ended;
        self.count();
        self.shared.try_publish(&self.counts);
        // The buffer lives as long as its writer.
        while !stop.load(Ordering::Relaxed) && !self.writer.is_drained()? {
            if self.pace == Pace::Live && (self.writer.readers() == 0 || now.elapsed() > LAST_READ)
            {
                break;
            }
            std::thread::sleep(ROOM_POLL);
            self.counts.turns += 1;
            self.publish_if_due(Instant::now());
        }
        Ok(())
    }

    fn count(&mut self) {
        self.counts.source = self.source.counters();
        if self.counts.source.stamped_late > 0 {
            self.counts.frame_time = FrameTime::Read;
        }
        self.counts.losses = *self.assembler.losses();
        if let Some(clock) = &self.clock {
            self.counts.clock = clock.counters();
        }
        self.counts.batches = self.writer.batches_sent();
    }
}
