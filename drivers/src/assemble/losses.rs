//! What was not used, by cause.

use serde::Serialize;

use crate::layout::Unreadable;

/// The one declaration of causes: the cause, its counter, its key. What people read is made of the
/// key by [`label`].
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
            /// Its name in JSON and metrics.
            pub fn key(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($counter),)+
                }
            }
        }

        impl $Losses {
            /// The count of each cause by its name, in the order of the causes.
            pub fn by_cause(&self) -> impl Iterator<Item = (&'static str, u64)> + use<> {
                [$((stringify!($counter), self.$counter)),+].into_iter()
            }

            /// All of them, whatever the cause.
            pub fn total(&self) -> u64 {
                self.by_cause().map(|(_, count)| count).sum()
            }

            /// What was counted since `before`.
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
    /// Why a frame was not used.
    FrameCause,
    /// Frames that were not used, by [`FrameCause`].
    FrameLosses {
        /// An error report of the CAN controller.
        Error => error,
        /// A remote request: it carries no data.
        Remote => remote,
        /// Not a message of the layout.
        UnknownId => unknown_id,
        /// Classic where the message is CAN FD, or the reverse.
        WrongFormat => wrong_format,
        /// Not the length of the message.
        WrongLength => wrong_length,
        /// Something else than its message by the layout's `except`, as an answer about a register.
        Excepted => excepted,
        /// A second frame of the same message, or SYNC, in one cycle.
        Duplicate => duplicate,
        /// A packed frame whose counter is that of the one before.
        CounterRepeated => counter_repeated,
        /// A frame of a cycle that was closed.
        Late => late,
        /// Before the first SYNC there is no cycle that it could belong to.
        BeforeFirstSync => before_first_sync,
        /// Carried references for a sample that has none, because another axis' was missing.
        ReferenceUnused => reference_unused,
        /// Good, but its cycle gave no sample: [`CycleCause`] counts why.
        CycleLost => cycle_lost,
    }
}

causes! {
    /// Why a bus cycle gave no sample.
    CycleCause,
    /// Bus cycles without a sample, by [`CycleCause`].
    CycleLosses {
        /// A gap in the train of SYNCs, or of packed frames without a counter; or the cycle before such
        /// a gap, where its last frames may be of the next cycle.
        MissingSync => missing_sync,
        /// A gap in the counter of the packed frames.
        CounterGap => counter_gap,
        /// A frame of an axis did not come; or did not before, where its signals are interpolated.
        MissingAxis => missing_axis,
        /// A slave of EtherCAT was in INIT, PREOP or BOOT, or reported an error (AL status). Remedy: look
        /// at the master.
        NotOperational => not_operational,
        /// A slave of EtherCAT was in SAFEOP: its drive takes no outputs.
        SafeOperational => safe_operational,
        /// The working counter of a datagram was not the expected one: a slave had not taken part, and which
        /// one cannot be told. Remedy: look at cables and slaves.
        WorkingCounter => working_counter,
        /// Two frames of one message said different things in one cycle.
        Contradiction => contradiction,
        /// A drive was not in the state "operation enabled" (CiA 402), or not in that of the layout's
        /// `enabled`.
        NotEnabled => not_enabled,
        /// A value was not finite, outside of the range in the DBC file, or half the integer's range
        /// from the one before.
        OutOfRange => out_of_range,
        /// The bus has not the period that the layout says, and is so far off (1 %, over five seconds) that
        /// its cycles cannot be counted. Whether the rate is right for parameters is judged of each window.
        /// Remedy: `rate_hz` or `period_us` of the layout.
        WrongPeriod => wrong_period,
        /// A second or more without a SYNC, or a packed frame: the cycles that there would have been, as far
        /// as the stamps tell. One, where the frames count the cycles.
        Silence => silence,
        /// The sequence of the bus began anew: a counter that does not go with the time. Or the positions
        /// did: three in a row agree with each other and not with the first. One cycle is counted.
        Restart => restart,
        /// The stamps went back in time, or a SYNC came where none belongs. One cycle is counted.
        ClockStep => clock_step,
        /// The sample was ready and nobody took it before the next.
        NotTaken => not_taken,
    }
}

/// The name of a cause as people read it.
pub fn label(key: &str) -> String {
    key.replace('_', " ")
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
    /// Cycles lost in which every drive said that it is not enabled: at rest, not in trouble. They are
    /// part of [`CycleLosses::not_enabled`] and [`CycleLosses::safe_operational`].
    pub cycles_idle: u64,
    /// Frames not used.
    pub frames: FrameLosses,
    /// Cycles lost.
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
