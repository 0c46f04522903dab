//! Common code of receiving sockets: waiting for frames, stamps, drops and the receive buffer.

use core::time::Duration;
use std::io;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::{Received, SourceError, capacity};
use crate::clock::HardwareClock;
use crate::frame::Frame;
use crate::socket::{Message, Socket};

/// Maximum number of system calls in one attempt to receive frames, regardless of the answers of
/// the kernel.
pub(super) const MAX_CALLS: u32 = 8;

/// Longest time of one wait. It lets a caller without a timeout detect an interface that vanished
/// without a report.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Source that receives frames from sockets. [`receive`] calls these functions between its waits.
pub(super) trait Listening {
    /// Returns the failure that occurred since the last call, or `None`.
    fn take_failure(&mut self) -> Option<SourceError>;

    /// Moves frames into the batch. Returns true if there were any.
    fn take_frames(&mut self, batch: &mut Vec<Frame>) -> bool;

    /// Checks the network devices of the sockets for changes that the sockets did not report.
    fn check_devices(&mut self);

    /// Returns the time after which to check the interfaces again although no frame arrives.
    /// Returns `None` if all interfaces are present and up.
    fn retry_in(&self) -> Option<Duration>;

    /// Waits for a frame, at most for the given time.
    fn wait_readable(&self, at_most: Duration) -> Result<(), SourceError>;
}

/// Receives frames as [`Source::receive`](super::Source::receive) describes.
pub(super) fn receive(
    source: &mut impl Listening,
    batch: &mut Vec<Frame>,
    timeout: Duration,
) -> Result<Received, SourceError> {
    if capacity(batch) == 0 {
        return Err(SourceError::NoRoom);
    }
    let started = Instant::now();
    let mut waited = false;
    loop {
        if let Some(failure) = source.take_failure() {
            return Err(failure);
        }
        if source.take_frames(batch) {
            return Ok(Received::Frames);
        }
        let remaining = timeout.saturating_sub(started.elapsed());
        if waited || remaining.is_zero() {
            // While the bus is silent, check the state of the interfaces.
            source.check_devices();
        }
        if let Some(failure) = source.take_failure() {
            return Err(failure);
        }
        if remaining.is_zero() {
            return Ok(Received::Silence);
        }
        let wait = source.retry_in().map_or(LONGEST_WAIT, |retry| retry.min(LONGEST_WAIT));
        source.wait_readable(remaining.min(wait))?;
        waited = true;
    }
}

/// Makes the kernel report the arrival time of each frame, and the number of dropped frames.
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

/// Requests a receive buffer of this size and returns the granted size \[bytes\].
pub(super) fn set_receive_buffer(socket: &Socket, wanted: u32) -> io::Result<u32> {
    // The kernel doubles the requested size for its own data, and reports the doubled size.
    let half = (wanted / 2).min(u32::MAX >> 2);
    let force = socket.set(libc::SOL_SOCKET, libc::SO_RCVBUFFORCE, half);
    if force.is_err() {
        // Without CAP_NET_ADMIN the kernel limits the size to net.core.rmem_max without an error.
        socket.set(libc::SOL_SOCKET, libc::SO_RCVBUF, half)?;
    }
    let granted = socket.get(libc::SOL_SOCKET, libc::SO_RCVBUF)?;
    Ok(u32::try_from(granted).unwrap_or(0))
}

/// Latest value of the kernel's counter of the frames that it dropped for one socket. The counter
/// wraps at 32 bits.
#[derive(Debug, Default)]
pub(super) struct DropCounter {
    last_count: u32,
}

impl DropCounter {
    /// Returns the number of frames dropped since the last call. `total` is the counter of the
    /// kernel.
    pub(super) fn advance(&mut self, total: u32) -> u64 {
        let new = total.wrapping_sub(core::mem::replace(&mut self.last_count, total));
        u64::from(new)
    }
}

/// Returns the arrival time of a message on CLOCK_REALTIME \[ns\]. The hardware stamp of the
/// controller is used if there is one.
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
