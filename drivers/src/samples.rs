//! From a source to samples: the one way of the frames of a bus, a log or a recording.

use core::time::Duration;

use didim_core::JointSample;

use crate::assemble::{Assembler, Losses};
use crate::clock::{ClockCounters, ClockMap, ClockPair};
use crate::frame::Frame;
use crate::socket::clock_pair;
use crate::source::{Received, Source, SourceCounters, SourceError, StampClock};

/// How long the iterator waits at a time; a log has no silence.
const WAIT: Duration = Duration::from_millis(20);

/// Gets all frames that were read together, with the stamps that the assembler sees, and the number
/// of frames dropped unread so far.
pub type Tap<'a> = Box<dyn FnMut(&[Frame], u64) + 'a>;

/// Reads both clocks of the machine.
pub type Clocks<'a> = Box<dyn FnMut() -> ClockPair + 'a>;

/// The samples of a source, in order. Nothing is allocated after [`Self::new`].
///
/// A bus thread alternates: [`Self::read`], which waits once, then [`Self::poll`] until nothing is
/// left. As an iterator it gives every sample to the end of a log, the one of the last cycle included.
pub struct Samples<'a> {
    source: Box<dyn Source>,
    assembler: Assembler,
    /// Maps stamps of CLOCK_REALTIME; nothing when the source has a clock of its own.
    clock: Option<ClockMap>,
    clocks: Clocks<'a>,
    tap: Option<Tap<'a>>,
    /// Frames that were read together.
    batch: Vec<Frame>,
    /// The one of them that is assembled next.
    next: usize,
    read_ns: u64,
}

/// A sample as it was assembled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assembled {
    /// The sample.
    pub sample: JointSample,
    /// Time of the frame that completed it \[ns, CLOCK_MONOTONIC\]: its stamp, or when it was read if
    /// the source has a clock of its own. Nothing when its cycle ended without a frame.
    pub completed_ns: Option<u64>,
}

impl<'a> Samples<'a> {
    /// Reads at most `frames` frames at a time, and one at least.
    pub fn new(source: Box<dyn Source>, assembler: Assembler, frames: usize) -> Self {
        Self::by(Box::new(clock_pair), source, assembler, frames)
    }

    /// As [`Self::new`], in the time of other clocks than the machine's.
    pub fn by(
        mut clocks: Clocks<'a>,
        source: Box<dyn Source>,
        assembler: Assembler,
        frames: usize,
    ) -> Self {
        let clock = match source.stamp_clock() {
            StampClock::Realtime => Some(ClockMap::new(clocks())),
            StampClock::Own => None,
        };
        let batch = Vec::with_capacity(frames.max(1));
        Self { source, assembler, clock, clocks, tap: None, batch, next: 0, read_ns: 0 }
    }

    /// Hands every frame to a tap as well.
    #[must_use]
    pub fn with_tap(self, tap: Option<Tap<'a>>) -> Self {
        Self { tap, ..self }
    }

    /// Waits at most `wait` for frames; at once while some are not assembled yet. A cycle that is over
    /// by the time of a silence, or that the end of a log cuts short, is decided.
    ///
    /// # Errors
    /// [`SourceError`]; [`SourceError::is_recoverable`] tells whether to call again.
    pub fn read(&mut self, wait: Duration) -> Result<Received, SourceError> {
        if self.next < self.batch.len() {
            return Ok(Received::Frames);
        }
        self.batch.clear();
        self.next = 0;
        let received = self.source.receive(&mut self.batch, wait)?;
        let now = (self.clocks)();
        self.read_ns = now.monotonic_ns;
        match received {
            Received::Frames => self.stamp(now),
            Received::Silence => {
                // Only a clock that we can read tells how late it is; a log's time is its frames'.
                if self.clock.is_some() {
                    self.assembler.handle_timeout(self.read_ns);
                }
            }
            Received::End => self.assembler.handle_timeout(u64::MAX),
        }
        Ok(received)
    }

    /// Maps the stamps of the frames that were read, and hands them to the tap.
    fn stamp(&mut self, now: ClockPair) {
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

    /// The next sample of what was read; nothing when all of it is assembled.
    pub fn poll(&mut self) -> Option<Assembled> {
        if let Some(sample) = self.assembler.poll_sample() {
            return Some(Assembled { sample, completed_ns: None });
        }
        while let Some(frame) = self.batch.get(self.next) {
            self.next += 1;
            self.assembler.handle_frame(frame);
            if let Some(sample) = self.assembler.poll_sample() {
                let completed_ns = if self.clock.is_some() { frame.stamp_ns } else { self.read_ns };
                return Some(Assembled { sample, completed_ns: Some(completed_ns) });
            }
        }
        None
    }

    /// When the last call of [`Self::read`] had what it gave \[ns, CLOCK_MONOTONIC\].
    pub fn read_ns(&self) -> u64 {
        self.read_ns
    }

    /// What the source counted.
    pub fn counters(&self) -> SourceCounters {
        self.source.counters()
    }

    /// What the assembler counted.
    pub fn losses(&self) -> &Losses {
        self.assembler.losses()
    }

    /// What mapping the stamps counted; nothing of a source with a clock of its own.
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
            match self.read(WAIT) {
                Ok(Received::End) => return self.poll().map(|Assembled { sample, .. }| Ok(sample)),
                Ok(Received::Frames | Received::Silence) => {}
                Err(error) => return Some(Err(error)),
            }
        }
    }
}
