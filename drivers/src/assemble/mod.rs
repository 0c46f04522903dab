//! Conversion of frames to samples: a pure state machine.
//!
//! The [`Assembler`] takes frames with their stamps and returns one [`JointSample`] per bus cycle.
//! It counts everything that does not become part of a sample under a cause ([`Losses`]). Time is
//! an argument of its functions. Nothing is allocated after [`Assembler::new`].
//!
//! # With a SYNC
//! Cycle k lasts from SYNC k to SYNC k + 1, but at most one period from its point on the grid that
//! follows the stamps (`grid`). Drives latch their position at SYNC k and send it within the cycle,
//! in any order. The sample has the stamp of the SYNC. A target in an RPDO received in cycle k
//! takes effect at SYNC k + 1 (CiA 301). So it is the reference of sample k + 1 if the layout says
//! `next-sync`. The assembler decides a cycle when the cycle ends, not when its last frame arrives:
//! a contradicting frame may arrive until then.
//!
//! A frame that arrives after the end of its cycle looks like a frame of the next cycle. The
//! assembler recognises a late frame if its message was missing in the previous cycle and arrives
//! twice in the present one. If a message arrives twice with different content and was not missing
//! before, the cycle is lost. A frame in the last quarter of a period may belong to the next cycle,
//! because the SYNC between them may have been missed. If the next SYNC does not arrive, a cycle
//! with such a frame is lost.
//!
//! # Without a SYNC
//! A message that arrives once a cycle takes the place of the SYNC, and every signal is valid at
//! the arrival of its own frame. Cycles begin and end as with a SYNC. The signals are interpolated
//! to the arrival of that message (`arrived`).
//!
//! # With a packed frame
//! Each packed frame is a complete cycle, and the assembler decides it at once. If the frame has a
//! counter, the counter gives the sequence number of the cycle.
//!
//! # In all cases
//! A bus whose period differs from the nominal one by 1 % or more gives no samples: see
//! [`CycleCause::WrongPeriod`].

mod arrival;
mod arrived;
mod continuity;
mod counter;
mod cycle;
mod grid;
mod limits;
mod losses;
mod packed;
mod period;
mod sync;
mod values;

use didim_dynamics::{JointSample, Readings};

pub use limits::AssemblyLimits;
pub use losses::{CycleCause, CycleLosses, FrameCause, FrameLosses, Losses, label};

use self::arrived::ArrivedValues;
use self::continuity::Continuity;
use self::cycle::{CompleteMask, Cycle};
use self::grid::Grid;
use self::period::PeriodWatch;
use self::values::{References, prior_cause};
use crate::frame::Frame;
use crate::layout::{CompiledLayout, CyclesBy, MessagePlan, Role, SampledBy};
use crate::units::Scales;

/// Converts frames to samples.
#[derive(Clone, Debug)]
pub struct Assembler {
    layout: CompiledLayout,
    state: State,
}

/// State of an assembler: its settings, and the data that change with the frames.
#[derive(Clone, Debug)]
struct State {
    limits: AssemblyLimits,
    scales: Scales,
    axes: usize,
    period_ns: f64,
    next_sync: bool,
    complete_mask: CompleteMask,
    /// Longest time between two values that are interpolated \[ns\]; `None` if the signals are not
    /// valid at the arrival of their frames.
    reach_ns: Option<u64>,
    /// Value of the enabled state of a drive, if the layout uses no status word.
    enabled_value: u16,
    /// True if the frames count the cycles, regardless of their stamps.
    by_frames: bool,
    grid: Option<Grid>,
    period_watch: PeriodWatch,
    /// Cycle that is being filled.
    open_cycle: Option<Cycle>,
    /// References that take effect at the next SYNC.
    pending_references: References,
    /// The latest value of each signal that is valid at the arrival of its frame.
    latest_arrivals: ArrivedValues,
    /// Readings received since the previous cycle was decided, and the number of frames that
    /// carried only readings.
    readings: Readings,
    reading_frames: u64,
    /// Messages that were missing in the previous cycle.
    missing_before: u64,
    /// Sequence number of the latest cycle.
    sequence: u64,
    /// Counter of the latest packed frame.
    counter: u64,
    continuity: Continuity,
    ready_sample: Option<ReadySample>,
    losses: Losses,
}

/// Sample that waits to be taken, and the number of its frames.
#[derive(Clone, Copy, Debug)]
struct ReadySample {
    sample: JointSample,
    frames: u64,
}

impl Assembler {
    /// Creates an assembler that has received nothing yet. All memory is allocated here.
    pub fn new(layout: CompiledLayout, scales: Scales) -> Self {
        let limits = AssemblyLimits::DEFAULT;
        let state = State {
            limits,
            scales,
            axes: layout.axes(),
            period_ns: layout.period_ns(),
            next_sync: layout.reference_at_next_sync(),
            complete_mask: CompleteMask::new(&layout),
            reach_ns: layout.at_arrival().then(|| reach_ns(&layout, &limits)),
            enabled_value: layout.enabled_value(),
            by_frames: layout.cycles_by() == CyclesBy::Frames,
            grid: None,
            period_watch: PeriodWatch::new(limits, layout.period_ns()),
            open_cycle: None,
            pending_references: References::default(),
            latest_arrivals: ArrivedValues::default(),
            readings: Readings::default(),
            reading_frames: 0,
            missing_before: 0,
            sequence: 0,
            counter: 0,
            continuity: Continuity::default(),
            ready_sample: None,
            losses: Losses::default(),
        };
        Self { layout, state }
    }

    /// Sets the sequence number of the first cycle, which is 0 by default. A recording that begins
    /// in the middle of the cycles needs it.
    #[must_use]
    pub fn starting_at(mut self, sequence: u64) -> Self {
        self.state.sequence = sequence;
        self
    }

    /// Takes one frame. At most one sample becomes ready. Call [`Self::poll_sample`] after every
    /// frame: a sample that was not taken before the next one is lost and counted as not taken.
    pub fn handle_frame(&mut self, frame: &Frame) {
        let state = &mut self.state;
        state.losses.frames_received += 1;
        let (index, message) = match self.layout.read(frame) {
            Ok(found) => found,
            Err(why) => return state.losses.frames.count(why.into(), 1),
        };
        if message.role == Role::Reading {
            return state.reading_frame(message, frame);
        }
        if state.reach_ns.is_some() {
            if message.role == Role::Sync {
                state.sync_frame(frame.stamp_ns);
            }
            return state.arrival_frame(index, message, frame);
        }
        match (self.layout.sampled_by(), message.role) {
            (SampledBy::Packed, _) => state.packed_frame(index, message, frame),
            (SampledBy::Sync, Role::Sync) => state.sync_frame(frame.stamp_ns),
            (SampledBy::Sync, Role::Sample) => state.sample_frame(index, message, frame),
            (SampledBy::Sync, Role::Target) => state.target_frame(index, message, frame),
            // The match above takes these frames.
            (SampledBy::Sync, Role::Reading) => {}
        }
    }

    /// Ends the open cycle if `now_ns`, on the clock of the stamps, is past the end of the cycle.
    /// Call it while the source is silent, not while frames are waiting, because those frames would
    /// then be late. `u64::MAX` at the end of a log gives the last sample.
    pub fn handle_timeout(&mut self, now_ns: u64) {
        self.state.end_by_time(now_ns);
    }

    /// Removes and returns the sample that is ready, or returns `None`.
    pub fn poll_sample(&mut self) -> Option<JointSample> {
        let state = &mut self.state;
        let ready = state.ready_sample.take()?;
        state.losses.frames_used += ready.frames;
        state.losses.samples += 1;
        if self.layout.has_reference() && !ready.sample.has_reference {
            state.losses.samples_without_reference += 1;
        }
        Some(ready.sample)
    }

    /// Returns the counts of frames, cycles and samples.
    pub fn losses(&self) -> &Losses {
        &self.state.losses
    }

    /// Returns the number of frames that are not part of a sample yet but may still become so.
    pub fn frames_waiting(&self) -> u64 {
        let state = &self.state;
        state.open_cycle.map_or(0, |cycle| cycle.frames + cycle.references.frames)
            + state.pending_references.frames
            + state.reading_frames
            + state.ready_sample.map_or(0, |ready| ready.frames)
    }

    /// Returns the number of cycles that are not decided yet, or whose sample was not taken yet.
    pub fn cycles_waiting(&self) -> u64 {
        u64::from(self.state.open_cycle.is_some()) + u64::from(self.state.ready_sample.is_some())
    }

    /// Returns the period of the bus cycle measured from the stamps \[ns\], or the nominal period
    /// before the first stamp. The result stays within 1 % of the nominal period. A bus outside of
    /// this range gives no samples ([`CycleCause::WrongPeriod`]).
    pub fn measured_period_ns(&self) -> f64 {
        self.state.grid.map_or(self.state.period_ns, |grid| grid.period_ns())
    }

    /// Returns the layout of the samples.
    pub fn layout(&self) -> &CompiledLayout {
        &self.layout
    }
}

impl State {
    /// Starts a grid with the first cycle at `stamp_ns`.
    fn start(&mut self, stamp_ns: u64) {
        self.start_grid(stamp_ns);
        self.losses.cycles_begun = 1;
    }

    /// Starts a new grid at `stamp_ns`, `cycles` cycles after the latest cycle. A `cycles` below 2
    /// counts as 2, so that data from before and after the gap are never joined.
    fn start_again(&mut self, stamp_ns: u64, cause: CycleCause, cycles: u64) {
        self.start_grid(stamp_ns);
        self.lose_all_but_last(cause, cycles.max(2));
    }

    fn start_grid(&mut self, stamp_ns: u64) {
        self.grid = Some(Grid::start(self.limits, self.period_ns, stamp_ns));
        self.continuity = Continuity::default();
        self.latest_arrivals = ArrivedValues::default();
        self.missing_before = 0;
    }

    /// Returns the number of cycles from the latest cycle to a stamp after a silence, estimated
    /// from the stamps. If the frames count the cycles, the result is 2, so that one cycle is
    /// missing.
    fn cycles_of_silence(&self, stamp_ns: u64) -> u64 {
        let periods =
            self.grid.filter(|_| !self.by_frames).map_or(2.0, |grid| grid.periods_to(stamp_ns));
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "2 to 2^64 / 10,000"
        )]
        let cycles = periods.round().max(2.0) as u64;
        cycles
    }

    /// Advances the sequence number by `cycles` and counts all of these cycles but the last as
    /// lost.
    fn lose_all_but_last(&mut self, cause: CycleCause, cycles: u64) {
        self.lose_cycles(cause, cycles - 1);
        self.sequence += 1;
        self.losses.cycles_begun += 1;
    }

    /// Advances the sequence number by `cycles` and counts all of these cycles as lost.
    fn lose_cycles(&mut self, cause: CycleCause, cycles: u64) {
        self.sequence += cycles;
        self.losses.cycles_begun += cycles;
        self.losses.cycles.count(cause, cycles);
    }

    /// Takes a frame that carries only readings. The readings belong to the next cycle that is
    /// decided, regardless of when in the cycle they arrive.
    fn reading_frame(&mut self, message: &MessagePlan, frame: &Frame) {
        if self.grid.is_none() {
            return self.losses.frames.count(FrameCause::BeforeFirstSync, 1);
        }
        self.end_by_time(frame.stamp_ns);
        message.read_readings(frame, &mut self.readings);
        self.reading_frames += 1;
    }

    /// Decides the open cycle: it becomes a sample or a loss. `followed` is true if the next SYNC
    /// has arrived.
    fn end_cycle(&mut self, followed: bool) {
        let Some(mut cycle) = self.open_cycle.take() else { return };
        let readings = core::mem::take(&mut self.readings);
        cycle.frames += core::mem::take(&mut self.reading_frames);
        if cycle.is_doubtful && !followed {
            cycle.fault = Some(CycleCause::MissingSync);
        }
        if self.period_watch.is_wrong() && !self.by_frames {
            cycle.fault = prior_cause(cycle.fault, CycleCause::WrongPeriod);
        }
        self.missing_before = self.complete_mask.missing_messages(&cycle);
        if cycle.fault.is_some() {
            // Do not interpolate from values of a drive that was not enabled, or from impossible
            // values.
            self.latest_arrivals = ArrivedValues::default();
        }
        let sample = cycle.sample(self.complete_mask, self.axes, &self.scales, self.reach_ns);
        let sample = sample.and_then(|sample| {
            let (position, confirming) =
                (&sample.motor_position_rad, self.limits.confirming_positions);
            self.continuity.check_and_store(position, self.axes, &self.scales, confirming)?;
            Ok(JointSample { readings, ..sample })
        });
        match sample {
            Err(cause) => {
                self.losses.cycles.count(cause, 1);
                let at_rest = matches!(cause, CycleCause::NotEnabled | CycleCause::SafeOperational);
                let idle = at_rest && cycle.is_idle(self.axes);
                self.losses.cycles_idle += u64::from(idle);
                let frames = cycle.frames + cycle.references.frames;
                self.losses.frames.count(FrameCause::CycleLost, frames);
            }
            Ok(sample) => {
                let mut frames = cycle.frames;
                if sample.has_reference {
                    frames += cycle.references.frames;
                } else {
                    let unused = cycle.references.frames;
                    self.losses.frames.count(FrameCause::ReferenceUnused, unused);
                }
                if let Some(lost) = self.ready_sample.replace(ReadySample { sample, frames }) {
                    self.losses.cycles.count(CycleCause::NotTaken, 1);
                    self.losses.frames.count(FrameCause::CycleLost, lost.frames);
                }
            }
        }
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a period: 1e4 to 1e9")]
fn reach_ns(layout: &CompiledLayout, limits: &AssemblyLimits) -> u64 {
    (limits.interpolation_periods * layout.period_ns()) as u64
}
