//! Where frames come from: one trait that can only receive.

mod ethercat;
mod in_process;
mod listening;
pub mod mcap;
mod retry;
mod socket_can;
mod text_log;

use core::time::Duration;

pub use self::mcap::{McapError, McapSource, McapWriter};
pub use ethercat::{CaptureSource, EthercatError, Seen, TapSource};
pub use in_process::{BusClosed, InProcessSender, InProcessSource, WhenFull, in_process_bus};
pub use socket_can::{
    LinkReport, QUEUED_FRAME_BYTES, SocketCanError, SocketCanOptions, SocketCanSource,
};
pub use text_log::{CandumpWriter, LineFault, StampDigits, TextLog, TextLogError, WriteError};

use crate::frame::Frame;
pub use crate::frame::interface::{InterfaceName, InterfaceNameError, MAX_INTERFACES};

/// What a call to [`Source::receive`] brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// At least one frame was appended to the batch.
    Frames,
    /// The time ran out with nothing on the bus.
    Silence,
    /// The source is exhausted: the end of a log, or a bus whose every sender is gone. Every
    /// further call says so again.
    End,
}

/// Whose time the stamps of a source are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampClock {
    /// The computer's CLOCK_REALTIME, which is set and slewed while frames arrive: map it with
    /// [`crate::clock`] before comparing stamps.
    Realtime,
    /// The source's own, which never steps: that of a log, or of a simulation.
    Own,
}

/// A receive-only source of frames.
///
/// Frames of one interface keep their order. A failure that leaves frames already read does not
/// swallow them: they are handed out first, and the next call reports the failure.
pub trait Source: Send {
    /// Waits at most `timeout` for frames and appends them to `batch`, never beyond its capacity
    /// (no allocation).
    ///
    /// # Errors
    /// See [`SourceError`]; [`SourceError::is_recoverable`] tells whether to call again.
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError>;

    /// What was counted since the source was opened.
    fn counters(&self) -> SourceCounters;

    /// The interfaces, in the order that [`Frame::interface`] counts them.
    fn interfaces(&self) -> &[InterfaceName];

    /// Whose time the stamps are.
    fn stamp_clock(&self) -> StampClock;

    /// What to add to stamps of an own clock for nanoseconds after 1970-01-01T00:00:00Z, if that is what they tell: those of a
    /// recording are of the clock that nobody sets.
    fn since_1970_ns(&self) -> i64 {
        0
    }
}

/// What a source counted since it was opened, over all its interfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceCounters {
    /// Frames handed out, error frames included.
    pub frames: u64,
    /// Frames dropped before this source because nobody read in time: by the kernel for want of
    /// room in the receive buffer, or by an in-process bus that may overflow. The kernel tells
    /// with the next frame that it queues after the loss.
    pub queue_drops: u64,
    /// Error frames of the controller.
    pub error_frames: u64,
    /// Times an interface was found down.
    pub link_down: u64,
    /// Times an interface had vanished and was opened again.
    pub reopened: u64,
    /// Frames passed over: of an interface that was not asked for, or of a kind that is not
    /// understood (CAN XL). With EtherCAT, packets that bring no process data of the layout, such as
    /// those of mailboxes.
    pub passed_over: u64,
    /// Frames without a stamp of the kernel, stamped when they were read instead.
    pub stamped_late: u64,
}

impl SourceCounters {
    /// These and others together, of several interfaces or of several files.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        // Without `..`: a count that is added to the structure is added here.
        Self {
            frames: self.frames + other.frames,
            queue_drops: self.queue_drops + other.queue_drops,
            error_frames: self.error_frames + other.error_frames,
            link_down: self.link_down + other.link_down,
            reopened: self.reopened + other.reopened,
            passed_over: self.passed_over + other.passed_over,
            stamped_late: self.stamped_late + other.stamped_late,
        }
    }
}

/// Why a source could not deliver.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The batch has no room. A mistake of the caller: hand over a batch with spare capacity.
    #[error("the batch has no room for a frame: empty it, or make it with a capacity")]
    NoRoom,
    /// A log could not be read.
    #[error(transparent)]
    TextLog(#[from] TextLogError),
    /// A recording could not be read.
    #[error(transparent)]
    Mcap(#[from] McapError),
    /// A capture, or a tap of EtherCAT, failed.
    #[error(transparent)]
    Ethercat(#[from] EthercatError),
    /// A SocketCAN interface failed.
    #[error(transparent)]
    SocketCan(#[from] SocketCanError),
}

impl SourceError {
    /// Whether a further call may bring frames. An unusable line of a log is passed over by the
    /// next call: a caller that must not lose frames stops here all the same.
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::NoRoom => true,
            Self::TextLog(error) => error.is_recoverable(),
            Self::Mcap(error) => error.is_recoverable(),
            Self::Ethercat(error) => error.is_recoverable(),
            Self::SocketCan(error) => error.is_recoverable(),
        }
    }
}

/// The free places of a batch.
fn room(batch: &Vec<Frame>) -> usize {
    batch.capacity() - batch.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_is_added() {
        let ones = SourceCounters {
            frames: 1,
            queue_drops: 10,
            error_frames: 100,
            link_down: 1_000,
            reopened: 10_000,
            passed_over: 100_000,
            stamped_late: 1_000_000,
        };
        let SourceCounters {
            frames,
            queue_drops,
            error_frames,
            link_down,
            reopened,
            passed_over,
            stamped_late,
        } = ones.plus(ones);
        let sums =
            [frames, queue_drops, error_frames, link_down, reopened, passed_over, stamped_late];
        assert_eq!(sums, [2, 20, 200, 2_000, 20_000, 200_000, 2_000_000]);
    }
}
