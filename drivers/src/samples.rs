//! Samples of a source, which is a bus, a log or a recording. All of them use the code in this
//! module.

use core::time::Duration;

use didim_dynamics::JointSample;

use crate::assemble::{Assembler, Losses};
use crate::clock::{ClockCounters, ClockMap, ClockPair};
use crate::frame::Frame;
use crate::socket::clock_pair;
use crate::source::{InterfaceFaults, Received, Source, SourceCounters, SourceError, StampClock};

/// Longest time for which the iterator waits in one call of [`Samples::read`]; a log never makes it
/// wait.
const POLL_WAIT: Duration = Duration::from_millis(20);

/// Function that receives all frames that were read together, with the stamps that the assembler
/// sees. The second argument is the total number of frames dropped unread until now.
pub type Tap<'a> = Box<dyn FnMut(&[Frame], u64) + 'a>;

/// Function that reads both clocks of the machine.
pub type Clocks<'a> = Box<dyn FnMut() -> ClockPair + 'a>;

/// Samples of a source, in order. Nothing is allocated after [`Self::new`].
///
/// A bus thread alternates between two calls. [`Self::read`] waits once, then [`Self::poll`] is
/// called until it returns no sample. The iterator returns every sample up to the end of a log,
/// including the sample of the last cycle.
pub struct Samples<'a> {
    source: Box<dyn Source>,
    assembler: Assembler,
    /// Maps stamps of CLOCK_REALTIME; `None` if the source has its own clock.
    clock: Option<ClockMap>,
    clocks: Clocks<'a>,
    tap: Option<Tap<'a>>,
    /// Frames that the last call of [`Self::read`] received together.
    batch: Vec<Frame>,
    /// Index in the batch of the next frame to assemble.
    next_frame: usize,
    read_ns: u64,
}

/// A sample with its completion time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assembled {
    /// The sample.
    pub sample: JointSample,
    /// Time of the frame that completed the sample \[ns, CLOCK_BOOTTIME\]: its stamp, or the time
    /// of reading if the source has its own clock. `None` if the cycle ended without a frame.
    pub completed_ns: Option<u64>,
}

impl<'a> Samples<'a> {
    /// Creates a reader that receives at most `frames` frames at a time, or one frame if `frames`
    /// is 0.
    pub fn new(source: Box<dyn Source>, assembler: Assembler, frames: usize) -> Self {
        Self::with_clocks(Box::new(clock_pair), source, assembler, frames)
    }

    /// Creates a reader like [`Self::new`] with other clocks than those of the machine.
    pub fn with_clocks(
        mut clocks: Clocks<'a>,
        source: Box<dyn Source>,
        assembler: Assembler,
        frames: usize,
    ) -> Self {
        let clock = match source.stamp_clock() {
            StampClock::Realtime => Some(ClockMap::new(clocks())),
            StampClock::Bus | StampClock::Own => None,
        };
        let batch = Vec::with_capacity(frames.max(1));
        Self { source, assembler, clock, clocks, tap: None, batch, next_frame: 0, read_ns: 0 }
    }

    /// Returns the reader with a tap that receives every frame.
    #[must_use]
    pub fn with_tap(self, tap: Option<Tap<'a>>) -> Self {
        Self { tap, ..self }
    }

    /// Waits at most `wait` for frames; returns at once if frames of the previous call are not
    /// assembled yet. If the source is silent, this call ends a cycle whose time is over. At the
    /// end of a log it ends the last cycle.
    ///
    /// # Errors
    /// [`SourceError`]; [`SourceError::is_recoverable`] is true if the call may be repeated.
    pub fn read(&mut self, wait: Duration) -> Result<Received, SourceError> {
        if self.next_frame < self.batch.len() {
            return Ok(Received::Frames);
        }
        self.batch.clear();
        self.next_frame = 0;
        let received = self.source.receive(&mut self.batch, wait)?;
        let now = (self.clocks)();
        self.read_ns = now.monotonic_ns;
        match received {
            Received::Frames => self.map_stamps(now),
            Received::Silence => {
                // Only a live source has a clock that can be read here. The time of a log is that
                // of its frames.
                if self.clock.is_some() {
                    self.assembler.handle_timeout(self.read_ns);
                }
            }
            Received::End => self.assembler.handle_timeout(u64::MAX),
        }
        Ok(received)
    }

    /// Maps the stamps of the frames that were read, and passes them to the tap.
    fn map_stamps(&mut self, now: ClockPair) {
        if let Some(clock) = &mut self.clock {
            clock.handle_pair(now);
            for frame in &mut self.batch {
                frame.stamp_ns = clock.map(frame.stamp_ns);
            }
        }
        if let Some(tap) = &mut self.tap {
            tap(&self.batch, self.source.counters().queue_drops);
        }
    }

    /// Returns the next sample of the frames that were read, or `None` if all of them are
    /// assembled.
    pub fn poll(&mut self) -> Option<Assembled> {
        if let Some(sample) = self.assembler.poll_sample() {
            return Some(Assembled { sample, completed_ns: None });
        }
        while let Some(frame) = self.batch.get(self.next_frame) {
            self.next_frame += 1;
            self.assembler.handle_frame(frame);
            if let Some(sample) = self.assembler.poll_sample() {
                let completed_ns = if self.clock.is_some() { frame.stamp_ns } else { self.read_ns };
                return Some(Assembled { sample, completed_ns: Some(completed_ns) });
            }
        }
        None
    }

    /// Returns the time at which the source last answered a call of [`Self::read`] without an error
    /// \[ns, CLOCK_BOOTTIME\].
    pub fn read_ns(&self) -> u64 {
        self.read_ns
    }

    /// Returns the counters of the source.
    pub fn counters(&self) -> SourceCounters {
        self.source.counters()
    }

    /// Returns [`Source::receive_buffer_bytes`].
    pub fn receive_buffer_bytes(&self) -> Option<u32> {
        self.source.receive_buffer_bytes()
    }

    /// Returns the interfaces that deliver no frames at present.
    pub fn interface_faults(&self) -> InterfaceFaults {
        self.source.interface_faults()
    }

    /// Returns the counters of the assembler.
    pub fn losses(&self) -> &Losses {
        self.assembler.losses()
    }

    /// Returns the counters of the stamp mapping, or `None` for a source with its own clock.
    pub fn clock_counters(&self) -> Option<ClockCounters> {
        self.clock.as_ref().map(ClockMap::counters)
    }
}

impl Iterator for Samples<'_> {
    type Item = Result<JointSample, SourceError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(Assembled { sample, .. }) = self.poll() {
                return Some(Ok(sample));
            }
            match self.read(POLL_WAIT) {
                Ok(Received::End) => return self.poll().map(|Assembled { sample, .. }| Ok(sample)),
                Ok(Received::Frames | Received::Silence) => {}
                Err(error) => return Some(Err(error)),
            }
        }
    }
}
