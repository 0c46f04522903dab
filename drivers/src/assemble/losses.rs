//! What was not used, by cause.

use serde::Serialize;

use crate::layout::Unreadable;

/// Why a frame was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameCause {
    /// An error report of the CAN controller.
    Error,
    /// A remote request: it carries no data.
    Remote,
    /// Not a message of the layout.
    UnknownId,
    /// Classic where the message is CAN FD, or the reverse.
    WrongFormat,
    /// Not the length of the message.
    WrongLength,
    /// A second frame of the same message, or SYNC, in one cycle.
    Duplicate,
    /// A packed frame whose counter is that of the one before.
    CounterRepeated,
    /// A frame of a cycle that was closed.
    Late,
    /// Before the first SYNC there is no cycle that it could belong to.
    BeforeFirstSync,
    /// Carried references for a sample that has none, because another axis' was missing.
    ReferenceUnused,
    /// Good, but its cycle gave no sample: [`CycleCause`] counts why.
    CycleLost,
}

/// Why a bus cycle gave no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CycleCause {
    /// A gap in the train of SYNCs, or of packed frames without a counter; or the cycle before such
    /// a gap, where its last frames may be of the next cycle.
    MissingSync,
    /// A gap in the counter of the packed frames.
    CounterGap,
    /// A frame of an axis did not come.
    MissingAxis,
    /// Two frames of one message said different things in one cycle.
    Contradiction,
    /// A drive was not in the state "operation enabled" (CiA 402).
    NotEnabled,
    /// A value was not finite, outside of the range in the DBC file, or half the integer's range
    /// from the one before.
    OutOfRange,
    /// The bus has not the period that the layout says: by more than 1 %, over five seconds. Remedy:
    /// `rate_hz` or `period_us` of the layout.
    WrongPeriod,
    /// The bus started again: silence, or a counter that does not go with the time. One cycle is
    /// counted, how many it would have been means nothing. Or the positions did: three in a row agree
    /// with each other and not with the first.
    Restart,
    /// The stamps went back in time, or a SYNC came where none belongs. One cycle is counted.
    ClockStep,
    /// The sample was ready and nobody took it before the next.
    NotTaken,
}

/// Frames that were not used, by [`FrameCause`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[allow(missing_docs, reason = "one counter per cause, documented there")]
pub struct FrameLosses {
    pub error: u64,
    pub remote: u64,
    pub unknown_id: u64,
    pub wrong_format: u64,
    pub wrong_length: u64,
    pub duplicate: u64,
    pub counter_repeated: u64,
    pub late: u64,
    pub before_first_sync: u64,
    pub reference_unused: u64,
    pub cycle_lost: u64,
}

/// Bus cycles without a sample, by [`CycleCause`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[allow(missing_docs, reason = "one counter per cause, documented there")]
pub struct CycleLosses {
    pub missing_sync: u64,
    pub counter_gap: u64,
    pub missing_axis: u64,
    pub contradiction: u64,
    pub not_enabled: u64,
    pub out_of_range: u64,
    pub wrong_period: u64,
    pub restart: u64,
    pub clock_step: u64,
    pub not_taken: u64,
}

/// Everything that was counted since the start. Two sums hold at any time:
///
/// - `frames_received = frames_used + frames.total() +` frames still waiting for a decision;
/// - `cycles_begun = samples + cycles.total() +` cycles still waiting for a decision (at most two).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Losses {
    /// Frames handed to the assembler.
    pub frames_received: u64,
    /// Frames that became part of a sample.
    pub frames_used: u64,
    /// Bus cycles since the first one: the sequence of the latest, plus one.
    pub cycles_begun: u64,
    /// Samples taken.
    pub samples: u64,
    /// Samples taken without a reference although the layout has one: it was missing or stale.
    pub samples_without_reference: u64,
    /// Frames not used.
    pub frames: FrameLosses,
    /// Cycles lost.
    pub cycles: CycleLosses,
}

impl FrameLosses {
    /// Frames not used, whatever the cause.
    pub fn total(&self) -> u64 {
        let Self { error, remote, unknown_id, wrong_format, wrong_length, .. } = self;
        let Self { duplicate, counter_repeated, late, before_first_sync, .. } = self;
        let Self { reference_unused, cycle_lost, .. } = self;
        error
            + remote
            + unknown_id
            + wrong_format
            + wrong_length
            + duplicate
            + counter_repeated
            + late
            + before_first_sync
            + reference_unused
            + cycle_lost
    }

    pub(super) fn count(&mut self, cause: FrameCause, frames: u64) {
        *match cause {
            FrameCause::Error => &mut self.error,
            FrameCause::Remote => &mut self.remote,
            FrameCause::UnknownId => &mut self.unknown_id,
            FrameCause::WrongFormat => &mut self.wrong_format,
            FrameCause::WrongLength => &mut self.wrong_length,
            FrameCause::Duplicate => &mut self.duplicate,
            FrameCause::CounterRepeated => &mut self.counter_repeated,
            FrameCause::Late => &mut self.late,
            FrameCause::BeforeFirstSync => &mut self.before_first_sync,
            FrameCause::ReferenceUnused => &mut self.reference_unused,
            FrameCause::CycleLost => &mut self.cycle_lost,
        } += frames;
    }
}

impl CycleLosses {
    /// Cycles lost, whatever the cause.
    pub fn total(&self) -> u64 {
        let Self { missing_sync, counter_gap, missing_axis, contradiction, not_enabled, .. } = self;
        let Self { out_of_range, wrong_period, restart, clock_step, not_taken, .. } = self;
        missing_sync
            + counter_gap
            + missing_axis
            + contradiction
            + not_enabled
            + out_of_range
            + wrong_period
            + restart
            + clock_step
            + not_taken
    }

    pub(super) fn count(&mut self, cause: CycleCause, cycles: u64) {
        *match cause {
            CycleCause::MissingSync => &mut self.missing_sync,
            CycleCause::CounterGap => &mut self.counter_gap,
            CycleCause::MissingAxis => &mut self.missing_axis,
            CycleCause::Contradiction => &mut self.contradiction,
            CycleCause::NotEnabled => &mut self.not_enabled,
            CycleCause::OutOfRange => &mut self.out_of_range,
            CycleCause::WrongPeriod => &mut self.wrong_period,
            CycleCause::Restart => &mut self.restart,
            CycleCause::ClockStep => &mut self.clock_step,
            CycleCause::NotTaken => &mut self.not_taken,
        } += cycles;
    }
}

impl From<Unreadable> for FrameCause {
    fn from(why: Unreadable) -> Self {
        match why {
            Unreadable::Error => Self::Error,
            Unreadable::Remote => Self::Remote,
            Unreadable::UnknownId => Self::UnknownId,
            Unreadable::WrongFormat => Self::WrongFormat,
            Unreadable::WrongLength => Self::WrongLength,
        }
    }
}
