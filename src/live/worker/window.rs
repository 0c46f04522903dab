//! A window of samples, or the reason why it was rejected.

use core::fmt;

use serde::{Deserialize, Serialize};

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
