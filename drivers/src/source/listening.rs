//! Common code of receiving sockets: waiting for frames, stamps, drops and the receive buffer.

use core::time::Duration;
use std::io;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::{Received, SourceError, capacity};
use crate::clock::HardwareClock;
use crate::frame::Frame;
use crate::socket::{Message, Socket};

/// Largest number of system calls of one attempt to receive frames, regardless of the kernel's
/// answers.
pub(super) const MAX_CALLS: u32 = 8;

/// Longest single wait, so that a caller without a timeout still detects an interface that vanished
/// silently.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// A source that receives from sockets, between two waits.
pub(super) trait Listening {
    /// Returns the failure since the last call.
    fn take_failure(&mut self) -> Option<SourceError>;

    /// Moves frames into the batch; returns true if there were any.
    fn take_frames(&mut self, batch: &mut Vec<Frame>) -> bool;

    /// Checks the devices behind the sockets for changes that the sockets did not report.
    fn check_devices(&mut self);

    /// Returns the time until the next call without a frame, or `None` if all interfaces are
    /// present and up.
    fn retry_in(&self) -> Option<Duration>;

    /// Waits for a frame, at most for the given time.
    fn wait_readable(&self, at_most: Duration) -> Result<(), SourceError>;
}

/// As [`Source::receive`](super::Source::receive).
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
            // During silence the state of the interfaces is worth a check.
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

/// Requests a buffer of this size and returns the granted size \[bytes\].
pub(super) fn set_receive_buffer(socket: &Socket, wanted: u32) -> io::Result<u32> {
    // The kernel doubles the requested size for its own book-keeping, and reports the double.
    let half = (wanted / 2).min(u32::MAX >> 2);
    let force = socket.set(libc::SOL_SOCKET, libc::SO_RCVBUFFORCE, half);
    if force.is_err() {
        // Without CAP_NET_ADMIN the kernel silently limits it to net.core.rmem_max.
        socket.set(libc::SOL_SOCKET, libc::SO_RCVBUF, half)?;
    }
    let granted = socket.get(libc::SOL_SOCKET, libc::SO_RCVBUF)?;
    Ok(u32::try_from(granted).unwrap_or(0))
}

/// Drop counter of the kernel for one socket, unwrapped.
#[derive(Debug, Default)]
pub(super) struct DropCounter {
    last_count: u32,
}

impl DropCounter {
    /// Returns the frames dropped since the last reading.
    pub(super) fn advance(&mut self, total: u32) -> u64 {
        let new = total.wrapping_sub(core::mem::replace(&mut self.last_count, total));
        u64::from(new)
    }
}

/// Returns CLOCK_REALTIME of the arrival, by the controller's clock if it has one.
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
