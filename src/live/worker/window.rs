//! A window of samples, or the reason why it was rejected.

use core::fmt;
use core::time::Duration;

use serde::{Deserialize, Serialize};

use crate::live::pause::{Pause, PauseCause};
use crate::window::Window;

/// A loss between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "loss", rename_all = "kebab-case")]
pub enum Loss {
    /// Bus cycles without a complete sample.
    SampleGap {
        /// Last sequence number before the gap.
        after: u64,
        /// Number of missing samples.
        missing: u64,
    },
    /// A sequence number that is not later than the previous one.
    OutOfOrder {
        /// Sequence number of the previous sample.
        after: u64,
        /// Received sequence number.
        sequence: u64,
    },
    /// Frames were dropped before they were read, and it is unknown which ones.
    QueueDrops {
        /// Number of frames.
        frames: u64,
    },
    /// Batches were overwritten in the buffer because the worker was too slow.
    StreamOverflow {
        /// Number of batches.
        batches: u64,
    },
    /// The acquisition was restarted.
    Restarted,
    /// The process was stopped, and frames or samples were lost meanwhile.
    ProcessStopped {
        /// Length of the stop \[ms\].
        stopped_ms: u64,
    },
    /// The machine was suspended, and received no frames meanwhile.
    MachineSuspended {
        /// Length of the suspension \[ms\].
        suspended_ms: u64,
    },
}

impl Loss {
    /// Derives the loss between two successive samples from their sequence numbers.
    pub(super) fn from_sequences(after: u64, sequence: u64) -> Option<Self> {
        if sequence <= after {
            return Some(Self::OutOfOrder { after, sequence });
        }
        let missing = sequence - after - 1;
        (missing > 0).then_some(Self::SampleGap { after, missing })
    }

    /// Returns the loss with a pause just before it as its cause, if the pause explains the loss.
    #[must_use]
    pub(super) fn explained_by(self, pause: &Pause) -> Self {
        let length_ms = u64::try_from(pause.duration.as_millis()).unwrap_or(u64::MAX);
        match (self, pause.cause) {
            (Self::OutOfOrder { .. } | Self::Restarted, _) | (_, PauseCause::NoProcessor) => self,
            (_, PauseCause::ProcessStopped) => Self::ProcessStopped { stopped_ms: length_ms },
            (_, PauseCause::MachineSuspended) => Self::MachineSuspended { suspended_ms: length_ms },
        }
    }

    /// Returns the pause that caused the loss.
    fn pause(self) -> Option<Pause> {
        let (cause, length_ms) = match self {
            Self::ProcessStopped { stopped_ms } => (PauseCause::ProcessStopped, stopped_ms),
            Self::MachineSuspended { suspended_ms } => (PauseCause::MachineSuspended, suspended_ms),
            _ => return None,
        };
        Some(Pause { cause, duration: Duration::from_millis(length_ms) })
    }
}

/// Reason why a window is not identified.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum Rejection {
    /// Data of the window were lost.
    Loss(Loss),
    /// The window has too few counted samples.
    TooShort {
        /// Number of counted samples.
        counted: usize,
        /// Required number of counted samples.
        minimum: usize,
    },
    /// The window is the remainder of a motion after a command identified the first part of the
    /// motion. It has too few counted samples.
    Remainder {
        /// Number of counted samples.
        counted: usize,
        /// Required number of counted samples.
        minimum: usize,
    },
    /// The identification is still busy with previous windows.
    Busy,
    /// The service was stopped before the window was identified.
    Stopped,
    /// The identification refused the window.
    Refused {
        /// Reason of the refusal.
        why: String,
    },
    /// The result could not be stored.
    NotStored {
        /// Reason of the failure.
        why: String,
    },
}

impl Rejection {
    /// Returns the name under which the rejection is counted.
    pub fn cause(&self) -> &'static str {
        match self {
            Self::Loss(Loss::SampleGap { .. }) => "sample-gap",
            Self::Loss(Loss::OutOfOrder { .. }) => "out-of-order",
            Self::Loss(Loss::QueueDrops { .. }) => "queue-drops",
            Self::Loss(Loss::StreamOverflow { .. }) => "stream-overflow",
            Self::Loss(Loss::Restarted) => "restarted",
            Self::Loss(Loss::ProcessStopped { .. }) => "process-stopped",
            Self::Loss(Loss::MachineSuspended { .. }) => "machine-suspended",
            Self::TooShort { .. } => "too-short",
            Self::Remainder { .. } => "remainder",
            Self::Busy => "busy",
            Self::Stopped => "stopped",
            Self::Refused { .. } => "refused",
            Self::NotStored { .. } => "not-stored",
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Loss(Loss::SampleGap { after, missing }) => {
                write!(f, "{missing} samples are missing after sample {after}")
            }
            Self::Loss(Loss::OutOfOrder { after, sequence }) => {
                write!(f, "sample {sequence} came after sample {after}")
            }
            Self::Loss(Loss::QueueDrops { frames }) => {
                write!(f, "{frames} frames were dropped unread")
            }
            Self::Loss(Loss::StreamOverflow { batches }) => {
                write!(f, "{batches} batches were overwritten before the worker read them")
            }
            Self::Loss(Loss::Restarted) => write!(f, "the acquisition was restarted"),
            Self::Loss(loss @ (Loss::ProcessStopped { .. } | Loss::MachineSuspended { .. })) => {
                loss.pause().iter().try_for_each(|pause| write!(f, "{pause}"))
            }
            Self::TooShort { counted, minimum } => {
                write!(f, "{counted} samples count, {minimum} are needed")
            }
            Self::Remainder { counted, minimum } => write!(
                f,
                "the rest of a motion that was identified by command: {counted} samples count, \
                {minimum} are needed"
            ),
            Self::Busy => write!(f, "the identification is busy with earlier windows"),
            Self::Stopped => write!(f, "the service was stopped before it was identified"),
            Self::Refused { why } => write!(f, "refused: {why}"),
            Self::NotStored { why } => write!(f, "the result could not be stored: {why}"),
        }
    }
}

/// A window that is not identified.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectedWindow {
    /// [`Window::number`].
    pub number: u64,
    /// Sequence number of the window's first sample.
    pub first_sequence: u64,
    /// Sequence number of the window's last sample.
    pub last_sequence: u64,
    /// Reason of the rejection.
    pub rejection: Rejection,
}

impl RejectedWindow {
    /// Rejects a complete window.
    pub(super) fn new(window: &Window, rejection: Rejection) -> Self {
        Self {
            number: window.number,
            first_sequence: window.first_sequence(),
            last_sequence: window.last_sequence(),
            rejection,
        }
    }
}

/// Event that results from a sample.
#[derive(Clone, Debug, PartialEq)]
pub enum WindowEvent {
    /// A window was closed and can be identified.
    Closed(Window),
    /// A window was rejected.
    Rejected(RejectedWindow),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_explains_the_loss_after_it() {
        let pause = |cause| Pause { cause, duration: Duration::from_millis(3_200) };
        let stopped = pause(PauseCause::ProcessStopped);
        for loss in [Loss::QueueDrops { frames: 9 }, Loss::SampleGap { after: 1, missing: 2 }] {
            let explained = Rejection::Loss(loss.explained_by(&stopped));
            assert_eq!(explained.cause(), "process-stopped");
            assert_eq!(explained.to_string(), "the process was stopped for 3.2 s");
            let suspended = loss.explained_by(&pause(PauseCause::MachineSuspended));
            assert_eq!(Rejection::Loss(suspended).cause(), "machine-suspended");
            assert_eq!(loss.explained_by(&pause(PauseCause::NoProcessor)), loss);
        }
        assert_eq!(Loss::Restarted.explained_by(&stopped), Loss::Restarted);
    }
}
