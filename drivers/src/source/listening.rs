//! What sockets that listen have in common: how frames are waited for, stamps, drops and the receive buffer.

use core::time::Duration;
use std::io;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::{Received, SourceError, room};
use crate::clock::HardwareClock;
use crate::frame::Frame;
use crate::socket::{Message, Socket};

/// System calls that one attempt to take frames may cost, whatever the kernel answers.
pub(super) const MOST_CALLS: u32 = 8;

/// The longest single wait, so that a caller without a timeout still notices an interface that
/// went away without a word.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// A source that listens at sockets, between two waits.
pub(super) trait Listening {
    /// What went wrong since the last call.
    fn take_failure(&mut self) -> Option<SourceError>;

    /// Moves frames into the batch; returns whether there were any.
    fn take(&mut self, batch: &mut Vec<Frame>) -> bool;

    /// Looks at the devices behind the sockets, for what the sockets did not tell.
    fn supervise(&mut self);

    /// When to come back without a frame; nothing where all interfaces are there and up.
    fn retry_in(&self) -> Option<Duration>;

    /// Waits for a frame, at most so long.
    fn wait(&self, at_most: Duration) -> Result<(), SourceError>;
}

/// As [`Source::receive`](super::Source::receive).
pub(super) fn receive(
    source: &mut impl Listening,
    batch: &mut Vec<Frame>,
    timeout: Duration,
) -> Result<Received, SourceError> {
    if room(batch) == 0 {
        return Err(SourceError::NoRoom);
    }
    let started = Instant::now();
    let mut waited = false;
    loop {
        if let Some(failure) = source.take_failure() {
            return Err(failure);
        }
        if source.take(batch) {
            return Ok(Received::Frames);
        }
        let left = timeout.saturating_sub(started.elapsed());
        if waited || left.is_zero() {
            // Silence is when the state of the interfaces is worth a look.
            source.supervise();
        }
        if let Some(failure) = source.take_failure() {
            return Err(failure);
        }
        if left.is_zero() {
            return Ok(Received::Silence);
        }
        let wait = source.retry_in().map_or(LONGEST_WAIT, |retry| retry.min(LONGEST_WAIT));
        source.wait(left.min(wait))?;
        waited = true;
    }
}

/// Has the kernel say with each frame when it came, and how many it dropped.
pub(super) fn ask_for_stamps_and_drops(socket: &Socket) -> io::Result<()> {
    socket.set(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, 1)?;
    let stamps = libc::SOF_TIMESTAMPING_RX_SOFTWARE
        | libc::SOF_TIMESTAMPING_SOFTWARE
        | libc::SOF_TIMESTAMPING_RX_HARDWARE
        | libc::SOF_TIMESTAMPING_RAW_HARDWARE;
    if socket.set(libc::SOL_SOCKET, libc::SO_TIMESTAMPING, stamps).is_err() {
        socket.set(libc::SOL_SOCKET, libc::SO_TIMESTAMPNS, 1)?;
    }
    Ok(())
}

/// Asks for a buffer of this size and returns what was granted \[bytes\].
pub(super) fn set_receive_buffer(socket: &Socket, wanted: u32) -> io::Result<u32> {
    // The kernel doubles what it is told, for its own book-keeping, and reports the double.
    let half = (wanted / 2).min(u32::MAX >> 2);
    let force = socket.set(libc::SOL_SOCKET, libc::SO_RCVBUFFORCE, half);
    if force.is_err() {
        // Without CAP_NET_ADMIN the kernel cuts it to net.core.rmem_max, without a word.
        socket.set(libc::SOL_SOCKET, libc::SO_RCVBUF, half)?;
    }
    let granted = socket.get(libc::SOL_SOCKET, libc::SO_RCVBUF)?;
    Ok(u32::try_from(granted).unwrap_or(0))
}

/// The kernel's drop counter of one socket, unwrapped.
#[derive(Debug, Default)]
pub(super) struct DropCounter {
    last: u32,
}

impl DropCounter {
    /// Frames dropped since the last reading.
    pub(super) fn advance(&mut self, total: u32) -> u64 {
        let new = total.wrapping_sub(core::mem::replace(&mut self.last, total));
        u64::from(new)
    }
}

/// CLOCK_REALTIME of the arrival, by the controller's clock where it has one.
pub(super) fn stamp_ns(message: &Message<'_>, hardware: &mut Option<HardwareClock>) -> Option<u64> {
    let software = message.control.software_ns?;
    Some(match message.control.hardware_ns {
        Some(stamp) => hardware.get_or_insert_default().realtime_ns(stamp, software),
        None => software,
    })
}

pub(super) fn realtime_now_ns() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(now.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drop_counter_is_exact_across_its_wrap() {
        let mut drops = DropCounter::default();
        assert_eq!(drops.advance(5), 5);
        assert_eq!(drops.advance(5), 0);
        assert_eq!(drops.advance(u32::MAX), u64::from(u32::MAX) - 5);
        assert_eq!(drops.advance(2), 3);
    }
}
