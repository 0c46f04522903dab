//! Sources of frames: one trait that can only receive.

mod blf;
mod ethercat;
mod in_process;
#[cfg(target_os = "linux")]
mod listening;
pub mod mcap;
#[cfg(target_os = "linux")]
mod retry;
#[cfg(target_os = "linux")]
mod socket_can;
mod text_log;

use core::time::Duration;

pub use self::mcap::{McapError, McapSource, McapWriter};
pub use blf::{BlfError, BlfSource};
#[cfg(target_os = "linux")]
pub use ethercat::TapSource;
pub use ethercat::{CaptureSource, EthercatError, TrafficSummary};
pub use in_process::{BusClosed, InProcessSender, InProcessSource, WhenFull, in_process_bus};
#[cfg(target_os = "linux")]
pub use socket_can::{
    LinkReport, QUEUED_FRAME_BYTES, SocketCanError, SocketCanOptions, SocketCanSource,
};
pub use text_log::{CandumpWriter, LineFault, StampDigits, TextLog, TextLogError, WriteError};

use crate::frame::Frame;
pub use crate::frame::interface::{InterfaceName, InterfaceNameError, MAX_INTERFACES};

/// Result of a call to [`Source::receive`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// At least one frame was appended to the batch.
    Frames,
    /// The time ran out without frames on the bus.
    Silence,
    /// The source is exhausted: the log has ended, or all senders of the bus are gone. Every
    /// further call returns this value again.
    End,
}

/// Clock of the stamps of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampClock {
    /// The computer's CLOCK_REALTIME, which is set and slewed while frames arrive: map it with
    /// [`crate::clock`] before comparing stamps.
    Realtime,
    /// A clock of the bus, which never steps and drifts against those of the computer. A frame has
    /// just arrived.
    Bus,
    /// The source's own clock, which never steps: that of a log, or of a simulation.
    Own,
}

/// A receive-only source of frames.
///
/// Frames of one interface keep their order. A failure does not discard frames that are already
/// read: they are returned first, and the next call reports the failure.
pub trait Source: Send {
    /// Waits at most `timeout` for frames and appends them to `batch`. The batch never grows beyond
    /// its capacity, so that nothing is allocated.
    ///
    /// # Errors
    /// See [`SourceError`]; [`SourceError::is_recoverable`] is true if the call may be repeated.
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError>;

    /// Returns the counters since the source was opened.
    fn counters(&self) -> SourceCounters;

    /// Returns the interfaces, in the order of their indices in [`Frame::interface`].
    fn interfaces(&self) -> &[InterfaceName];

    /// Returns the clock of the stamps.
    fn stamp_clock(&self) -> StampClock;

    /// Returns the smallest receive buffer of the open interfaces, in the kernel's accounting
    /// \[bytes\]. `None` if no interface is open, and for a source without sockets.
    fn receive_buffer_bytes(&self) -> Option<u32> {
        None
    }

    /// Returns the interfaces that deliver no frames at present. A log has none.
    fn interface_faults(&self) -> InterfaceFaults {
        InterfaceFaults::default()
    }

    /// Returns the offset from stamps of the source's own clock to nanoseconds after
    /// 1970-01-01T00:00:00Z, or 0 if the source does not know it. The stamps of a recording are
    /// those of a clock that is never set.
    fn since_1970_ns(&self) -> i64 {
        0
    }
}

/// Fault of an interface at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InterfaceFault {
    /// The interface is down.
    Down,
    /// There is no interface of this name.
    Missing,
}

/// Interfaces of a source that deliver no frames at present.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InterfaceFaults([Option<InterfaceFault>; MAX_INTERFACES]);

impl InterfaceFaults {
    /// Creates the set from the faults of the interfaces, in their order.
    pub fn new(faults: impl Iterator<Item = Option<InterfaceFault>>) -> Self {
        let mut all = Self::default();
        for (place, fault) in all.0.iter_mut().zip(faults) {
            *place = fault;
        }
        all
    }

    /// Returns the fault of the interface with this index.
    pub fn get(&self, index: usize) -> Option<InterfaceFault> {
        self.0.get(index).copied().flatten()
    }

    /// Returns true if every interface is present and up.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }
}

/// Counters of a source since it was opened, over all its interfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceCounters {
    /// Frames returned, including error frames.
    pub frames: u64,
    /// Frames that were dropped because this source did not read them in time. The kernel drops
    /// frames if the receive buffer is full. An in-process bus drops them if its queue is full and
    /// the bus was created with `WhenFull::Drop`. The kernel reports the loss with the next frame
    /// that it queues.
    pub queue_drops: u64,
    /// Error frames of the CAN controller.
    pub error_frames: u64,
    /// Number of times that an interface was found down.
    pub link_down: u64,
    /// Number of times that a vanished interface was opened again.
    pub reopened: u64,
    /// Skipped frames: those of an interface that was not requested, and those of an unknown kind
    /// (CAN XL). For EtherCAT, packets without process data of the layout, such as packets of
    /// mailboxes.
    pub passed_over: u64,
    /// Frames without a stamp of the kernel; this source stamped them when it read them.
    pub stamped_late: u64,
}

impl SourceCounters {
    /// Returns the sums of both sets of counters, for several interfaces or several files.
    #[must_use]
    pub fn sum_with(self, other: Self) -> Self {
        // Every field is named, without `..`, so that a new counter cannot be forgotten here.
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

/// Reason why a source could not deliver.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The batch has no free capacity. This is an error of the caller: pass a batch with spare
    /// capacity.
    #[error("the batch has no room for a frame: empty it, or make it with a capacity")]
    NoRoom,
    /// A log could not be read.
    #[error(transparent)]
    TextLog(#[from] TextLogError),
    /// A binary log could not be read.
    #[error(transparent)]
    Blf(#[from] BlfError),
    /// A recording could not be read.
    #[error(transparent)]
    Mcap(#[from] McapError),
    /// A capture, or a tap of EtherCAT, failed.
    #[error(transparent)]
    Ethercat(#[from] EthercatError),
    /// A SocketCAN interface failed.
    #[cfg(target_os = "linux")]
    #[error(transparent)]
    SocketCan(#[from] SocketCanError),
}

impl SourceError {
    /// Returns true if a further call may return frames. For example, the next call skips an
    /// unusable line of a log. A caller that must not lose frames has to stop here all the same.
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::NoRoom => true,
            Self::TextLog(error) => error.is_recoverable(),
            Self::Blf(_) => false,
            Self::Mcap(error) => error.is_recoverable(),
            Self::Ethercat(error) => error.is_recoverable(),
            #[cfg(target_os = "linux")]
            Self::SocketCan(error) => error.is_recoverable(),
        }
    }
}

/// A log names more interfaces than a source can have.
struct TooManyInterfaces;

/// Returns the index of an interface of a log. A new one is added, unless the interfaces are fixed:
/// then it is `None`.
fn index_of(
    interfaces: &mut Vec<InterfaceName>,
    name: InterfaceName,
    are_fixed: bool,
) -> Result<Option<u8>, TooManyInterfaces> {
    let index = match interfaces.iter().position(|available| *available == name) {
        Some(index) => index,
        None if are_fixed => return Ok(None),
        None if interfaces.len() == MAX_INTERFACES => return Err(TooManyInterfaces),
        None => {
            interfaces.push(name);
            interfaces.len() - 1
        }
    };
    Ok(u8::try_from(index).ok())
}

/// Returns the free capacity of a batch.
fn capacity(batch: &Vec<Frame>) -> usize {
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
        } = ones.sum_with(ones);
        let sums =
            [frames, queue_drops, error_frames, link_down, reopened, passed_over, stamped_late];
        assert_eq!(sums, [2, 20, 200, 2_000, 20_000, 200_000, 2_000_000]);
    }
}
