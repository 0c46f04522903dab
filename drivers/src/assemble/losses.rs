//! Counts of unused frames and cycles, by cause.

use serde::Serialize;

use crate::layout::Unreadable;

/// Declares each cause in one place, with its counter and its key. [`label`] makes the readable
/// name from the key.
macro_rules! causes {
    (
        $(#[$of_cause:meta])* $Cause:ident,
        $(#[$of_losses:meta])* $Losses:ident {
            $($(#[$doc:meta])+ $variant:ident => $counter:ident,)+
        }
    ) => {
        $(#[$of_cause])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $Cause {
            $($(#[$doc])+ $variant,)+
        }

        $(#[$of_losses])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct $Losses {
            $($(#[$doc])+ pub $counter: u64,)+
        }

        impl $Cause {
            /// Returns the name of the cause in JSON and metrics.
            pub fn key(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($counter),)+
                }
            }
        }

        impl $Losses {
            /// Returns the name and the count of each cause, in the order of the causes.
            pub fn by_cause(&self) -> impl Iterator<Item = (&'static str, u64)> + use<> {
                [$((stringify!($counter), self.$counter)),+].into_iter()
            }

            /// Returns the sum over all causes.
            pub fn total(&self) -> u64 {
                self.by_cause().map(|(_, count)| count).sum()
            }

            /// Returns the counts since `before`.
            #[must_use]
            pub fn since(&self, before: &Self) -> Self {
                Self { $($counter: self.$counter.saturating_sub(before.$counter),)+ }
            }

            pub(super) fn count(&mut self, cause: $Cause, more: u64) {
                *match cause {
                    $($Cause::$variant => &mut self.$counter,)+
                } += more;
            }
        }
    };
}

causes! {
    /// Reason for not using a frame.
    FrameCause,
    /// Number of unused frames, by [`FrameCause`].
    FrameLosses {
        /// An error report of the CAN controller.
        Error => error,
        /// A remote request: it carries no data.
        Remote => remote,
        /// Not a message of the layout.
        UnknownId => unknown_id,
        /// The frame is classic and the message is CAN FD, or the reverse.
        WrongFormat => wrong_format,
        /// The length differs from that of the message.
        WrongLength => wrong_length,
        /// The frame has other content than the message, such as a reply about a register (`except`
        /// in the layout).
        Excepted => excepted,
        /// A second frame of the same message, or SYNC, in one cycle.
        Duplicate => duplicate,
        /// A packed frame with the same counter as the previous one.
        CounterRepeated => counter_repeated,
        /// A frame of a cycle that is already closed.
        Late => late,
        /// A frame before the first SYNC: there is no cycle that it could belong to.
        BeforeFirstSync => before_first_sync,
        /// The frame carried references for a sample without references, because the reference of
        /// another axis was missing.
        ReferenceUnused => reference_unused,
        /// A valid frame whose cycle gave no sample: [`CycleCause`] counts the reason.
        CycleLost => cycle_lost,
    }
}

causes! {
    /// Reason for a bus cycle without a sample.
    CycleCause,
    /// Number of bus cycles without a sample, by [`CycleCause`].
    CycleLosses {
        /// A gap in the train of SYNCs, or of packed frames without a counter. Also the cycle
        /// before such a gap if its last frames may belong to the next cycle.
        MissingSync => missing_sync,
        /// A gap in the counter of the packed frames.
        CounterGap => counter_gap,
        /// A frame of an axis is missing. If signals are interpolated, the missing frame may be the
        /// one before.
        MissingAxis => missing_axis,
        /// An EtherCAT slave was in INIT, PREOP or BOOT, or reported an error (AL status). Remedy:
        /// check the master.
        NotOperational => not_operational,
        /// An EtherCAT slave was in SAFEOP: its drive takes no outputs.
        SafeOperational => safe_operational,
        /// The working counter of a datagram differed from the expected one: a slave did not take
        /// part. The counter does not show which one. Remedy: check cables and slaves.
        WorkingCounter => working_counter,
        /// Two frames of one message had different content in one cycle.
        Contradiction => contradiction,
        /// A drive was not in the state "operation enabled" (CiA 402), or not in the state of the
        /// layout's `enabled`.
        NotEnabled => not_enabled,
        /// A value was not finite, or was outside of the range in the DBC file. Or a position
        /// differed by half the range of its integer or more from the previous one.
        OutOfRange => out_of_range,
        /// The period of the bus differs from that of the layout. The difference (1 %, over five
        /// seconds) is so large that the cycles cannot be counted. Each window is checked
        /// separately for a rate that is exact enough for parameters. Remedy: `rate_hz` or
        /// `period_us` of the layout.
        WrongPeriod => wrong_period,
        /// No SYNC, or no packed frame, arrived for a second or more. The number of cycles in that
        /// time is estimated from the stamps and counted. If the frames count the cycles, one cycle
        /// is counted.
        Silence => silence,
        /// The sender of the cycles has started again: the counter contradicts the time, or the
        /// positions show it. Three positions in a row agree with each other and not with the first
        /// one. One cycle is counted.
        Restart => restart,
        /// The stamps went back in time, or a SYNC arrived at an impossible time. One cycle is
        /// counted.
        ClockStep => clock_step,
        /// The sample was ready, but the caller did not take it before the next one.
        NotTaken => not_taken,
    }
}

/// Returns the readable name of a cause.
pub fn label(key: &str) -> String {
    key.replace('_', " ")
}

/// All counts since the start. Two sums hold at any time:
///
/// - `frames_received = frames_used + frames.total() +` frames that are not decided yet;
/// - `cycles_begun = samples + cycles.total() +` cycles that are not decided yet (at most two).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Losses {
    /// Number of frames passed to the assembler.
    pub frames_received: u64,
    /// Number of frames that became part of a sample.
    pub frames_used: u64,
    /// Number of bus cycles since the first one: the latest sequence number plus one.
    pub cycles_begun: u64,
    /// Number of samples that the caller took.
    pub samples: u64,
    /// Number of samples taken without a reference although the layout has one: the reference was
    /// missing or outdated.
    pub samples_without_reference: u64,
    /// Number of lost cycles in which every drive reported that it is not enabled, as at rest and
    /// without a fault. These cycles are part of [`CycleLosses::not_enabled`] and
    /// [`CycleLosses::safe_operational`].
    pub cycles_idle: u64,
    /// Counts of unused frames, by cause.
    pub frames: FrameLosses,
    /// Counts of lost cycles, by cause.
    pub cycles: CycleLosses,
}

impl From<Unreadable> for FrameCause {
    fn from(why: Unreadable) -> Self {
        match why {
            Unreadable::Error => Self::Error,
            Unreadable::Remote => Self::Remote,
            Unreadable::UnknownId => Self::UnknownId,
            Unreadable::WrongFormat => Self::WrongFormat,
            Unreadable::WrongLength => Self::WrongLength,
            Unreadable::Excepted => Self::Excepted,
        }
    }
}
