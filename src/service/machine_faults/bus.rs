//! A bus and the clocks of a machine in virtual time: motions one after the other, with stamps of a
//! kernel.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard};
use std::time::Duration;

use didim_drivers::clock::ClockPair;
use didim_drivers::frame::Frame;
use didim_drivers::source::{
    InterfaceName, Received, SocketCanError, Source, SourceCounters, SourceError, StampClock,
};

use super::arm::EPOCH_NS;

/// When the bus begins \[ns\].
pub(super) const START_NS: u64 = 5_000_000_000;
/// Frames that the kernel keeps for a process that does not read.
const KERNEL_FRAMES: usize = 4_096;

/// State of the bus, and the clocks of the machine.
#[derive(Clone)]
pub(super) struct Bus(Arc<Mutex<State>>);

pub(super) struct State {
    clocks: ClockPair,
    period_ns: u64,
    /// Cycles of a motion, and of the one that is damaged.
    motion: Vec<Vec<Frame>>,
    damaged: Option<(u64, Vec<Vec<Frame>>)>,
    /// The next cycle, and the number of cycles.
    pub(super) next: u64,
    pub(super) cycles: u64,
    /// Frames that wait in the kernel.
    waiting: VecDeque<Frame>,
    /// Waits that a signal ends.
    pub(super) interrupted: u64,
    /// Cycles for which the interface is away, and whether that is reported.
    gone: Range<u64>,
    is_reported: bool,
    counters: SourceCounters,
}

impl State {
    pub(super) fn length(&self) -> u64 {
        self.motion.len() as u64
    }

    /// Returns the next cycle, and the end of the bus.
    pub(super) fn now_and_end(&self) -> (u64, u64) {
        (self.next, self.cycles)
    }

    /// Returns the number of cycles of a motion, and of all of them.
    pub(super) fn lengths(&self) -> (u64, u64) {
        (self.length(), self.cycles)
    }

    /// Returns a duration in cycles.
    pub(super) fn cycles_in(&self, ns: u64) -> u64 {
        ns / self.period_ns
    }

    pub(super) fn unix_s(&self) -> u64 {
        self.clocks.realtime_ns / 1_000_000_000
    }

    /// Sets the wall clock by so much.
    pub(super) fn set_wall(&mut self, by_ns: i64) {
        self.clocks.realtime_ns = self.clocks.realtime_ns.saturating_add_signed(by_ns);
    }

    /// Lets a cycle pass; returns its frames with their stamps.
    fn pass(&mut self) -> Vec<Frame> {
        let (motion, cycle) = (self.next / self.length(), self.next % self.length());
        let index = usize::try_from(cycle).unwrap_or(0);
        let cycles = match &self.damaged {
            Some((damaged, cycles)) if *damaged == motion => cycles,
            _ => &self.motion,
        };
        let (begin, epoch) = (START_NS + self.next * self.period_ns, EPOCH_NS);
        let first = epoch + cycle * self.period_ns;
        let wall = self.clocks;
        let begin_ns = wall.realtime_ns - wall.monotonic_ns + begin;
        let stamped = |frame: &Frame| frame.with_stamp(begin_ns + (frame.stamp_ns - first));
        let frames = cycles[index].iter().map(stamped).collect();
        self.next += 1;
        // It is read shortly before the next one.
        let step_ns = begin + self.period_ns - 1_000 - wall.monotonic_ns;
        self.clocks.monotonic_ns += step_ns;
        self.clocks.realtime_ns += step_ns;
        frames
    }

    /// Lets cycles pass that no process hears.
    pub(super) fn pass_unheard(&mut self, cycles: u64) {
        for _ in 0..cycles.min(self.cycles - self.next) {
            self.pass();
        }
        self.waiting.clear();
    }

    /// Lets cycles pass while the process is stopped. Returns the number of frames that the kernel
    /// drops.
    pub(super) fn pass_stopped(&mut self, cycles: u64) -> u64 {
        let before = self.counters.queue_drops;
        for _ in 0..cycles.min(self.cycles - self.next) {
            let is_heard = !self.gone.contains(&self.next);
            for frame in self.pass() {
                if is_heard && self.waiting.len() < KERNEL_FRAMES {
                    self.waiting.push_back(frame);
                } else {
                    self.counters.queue_drops += u64::from(is_heard);
                }
            }
        }
        self.counters.queue_drops - before
    }

    /// Takes the interface away for so many cycles.
    pub(super) fn take_interface(&mut self, cycles: u64) {
        self.gone = self.next..(self.next + cycles).min(self.cycles);
        self.is_reported = false;
    }
}

impl Bus {
    pub(super) fn new(
        period_ns: u64,
        motion: Vec<Vec<Frame>>,
        damaged: Option<(u64, Vec<Vec<Frame>>)>,
        motions: u64,
    ) -> Self {
        let clocks = ClockPair {
            realtime_ns: EPOCH_NS + START_NS,
            monotonic_ns: START_NS,
            uncertainty_ns: 100,
        };
        Self(Arc::new(Mutex::new(State {
            clocks,
            period_ns,
            cycles: motions * motion.len() as u64,
            motion,
            damaged,
            next: 0,
            waiting: VecDeque::new(),
            interrupted: 0,
            gone: 0..0,
            is_reported: true,
            counters: SourceCounters::default(),
        })))
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }

    pub(super) fn clocks(&self) -> ClockPair {
        self.state().clocks
    }
}

impl Source for Bus {
    fn receive(&mut self, batch: &mut Vec<Frame>, wait: Duration) -> Result<Received, SourceError> {
        let mut state = self.state();
        while batch.len() < batch.capacity()
            && let Some(frame) = state.waiting.pop_front()
        {
            batch.push(frame);
        }
        if !batch.is_empty() {
            return Ok(Received::Frames);
        }
        if state.next >= state.cycles {
            return Ok(Received::End);
        }
        if state.interrupted > 0 {
            state.interrupted -= 1;
            return Ok(Received::Silence);
        }
        if state.gone.contains(&state.next) {
            if !std::mem::replace(&mut state.is_reported, true) {
                let interface = INTERFACE[0];
                return Err(SocketCanError::Gone { interface }.into());
            }
            let cycles = state.cycles_in(wait.as_nanos().try_into().unwrap_or(0)).max(1);
            let until = (state.next + cycles).min(state.gone.end);
            let cycles = until - state.next;
            state.pass_unheard(cycles);
            return Ok(Received::Silence);
        }
        let frames = state.pass();
        state.counters.frames += frames.len() as u64;
        batch.extend(frames);
        Ok(if batch.is_empty() { Received::Silence } else { Received::Frames })
    }

    fn counters(&self) -> SourceCounters {
        self.state().counters
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &*INTERFACE
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Realtime
    }
}

static INTERFACE: LazyLock<[InterfaceName; 1]> =
    LazyLock::new(|| [InterfaceName::new("can0").unwrap()]);
