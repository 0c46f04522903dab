//! One interface of a source, with its frames, its counters and its state.

use core::time::Duration;
use std::io;
use std::time::Instant;

use super::error::SocketCanError;
use super::open::{OpenedSocket, open};
use super::options::SocketCanOptions;
use crate::clock::HardwareClock;
use crate::frame::{Direction, Frame, FrameError, FrameId, FrameKind};
use crate::socket::{Message, ReceiveBuffer, Socket, device_state};
use crate::source::listening::{DropCounter, MAX_CALLS, realtime_now_ns, stamp_ns};
use crate::source::retry::{self, Retry};
use crate::source::{InterfaceFault, InterfaceName, SourceCounters};

/// Granted settings and counters of an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkReport {
    /// Name of the interface.
    pub interface: InterfaceName,
    /// True if the interface is present and up, as far as the source knows.
    pub is_up: bool,
    /// Size of the largest frame of the interface \[bytes\]: 16 for classic CAN, 72 for CAN FD.
    pub mtu: i32,
    /// Granted size of the receive buffer \[bytes\]. It is smaller than the requested size if
    /// `net.core.rmem_max` is smaller and the process lacks CAP_NET_ADMIN.
    pub receive_buffer_bytes: u32,
    /// True if the stamps are those of the controller.
    pub hardware_stamps: bool,
    /// Counters of this interface alone.
    pub counters: SourceCounters,
}

/// State of an interface. Frames can arrive only if it is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Up,
    Down,
    /// The device has vanished. The socket stays unusable even if the device returns.
    Gone(Retry),
}

pub(super) struct Link {
    name: InterfaceName,
    /// Index of the interface in the order of the source.
    index: u8,
    options: SocketCanOptions,
    opened: Option<OpenedSocket>,
    last_opened: (i32, u32),
    state: State,
    buffer: ReceiveBuffer,
    head_frame: Option<Frame>,
    drops: DropCounter,
    hardware_clock: Option<HardwareClock>,
    counters: SourceCounters,
    failure: Option<SocketCanError>,
}

impl Link {
    pub(super) fn open(
        name: InterfaceName,
        index: u8,
        options: &SocketCanOptions,
    ) -> Result<Self, SocketCanError> {
        let (opened, missing) = match open(name, options) {
            Ok(opened) => (Some(opened), None),
            Err(missing @ SocketCanError::NoInterface { .. }) if options.waits_for_interfaces => {
                (None, Some(missing))
            }
            Err(error) => return Err(error),
        };
        Ok(Self {
            name,
            index,
            options: options.clone(),
            last_opened: opened.as_ref().map_or((0, 0), OpenedSocket::granted),
            state: match opened {
                Some(_) => State::Up,
                None => State::Gone(Retry::after_loss(Instant::now())),
            },
            opened,
            buffer: ReceiveBuffer::new(),
            head_frame: None,
            drops: DropCounter::default(),
            hardware_clock: None,
            counters: SourceCounters {
                link_down: u64::from(missing.is_some()),
                ..SourceCounters::default()
            },
            failure: missing,
        })
    }

    pub(super) fn name(&self) -> InterfaceName {
        self.name
    }

    pub(super) fn report(&self) -> LinkReport {
        let (mtu, receive_buffer_bytes) = self.last_opened;
        LinkReport {
            interface: self.name,
            is_up: self.state == State::Up,
            mtu,
            receive_buffer_bytes,
            hardware_stamps: self.hardware_clock.is_some(),
            counters: self.counters,
        }
    }

    pub(super) fn fault(&self) -> Option<InterfaceFault> {
        match self.state {
            State::Up => None,
            State::Down => Some(InterfaceFault::Down),
            State::Gone(_) => Some(InterfaceFault::Missing),
        }
    }

    /// Returns the socket of the interface, or `None` while the interface is gone.
    pub(super) fn socket(&self) -> Option<&Socket> {
        self.opened.as_ref().map(|opened| &opened.socket)
    }

    /// Returns the time after which to check the interface again although no frame arrives. Returns
    /// `None` if the interface is up.
    pub(super) fn retry_in(&self) -> Option<Duration> {
        match self.state {
            State::Up => None,
            State::Down => Some(retry::FIRST_DELAY),
            State::Gone(retry) => Some(retry.remaining(Instant::now())),
        }
    }

    pub(super) fn take_failure(&mut self) -> Option<SocketCanError> {
        self.failure.take()
    }

    /// Returns the stamp of the next frame, or `None` if no frame is available.
    pub(super) fn head_stamp(&self) -> Option<u64> {
        self.head_frame.map(|frame| frame.stamp_ns)
    }

    /// Removes and returns the next frame.
    pub(super) fn take_frame(&mut self) -> Option<Frame> {
        let frame = self.head_frame.take()?;
        self.counters.frames += 1;
        self.counters.error_frames += u64::from(frame.is_error());
        self.advance();
        Some(frame)
    }

    /// Returns true if all frames taken from the kernel are used up and more frames may wait in the
    /// kernel.
    pub(super) fn may_have_older(&self) -> bool {
        self.head_frame.is_none() && self.buffer.was_full()
    }

    /// Takes frames from the kernel if none is left. Does not wait.
    pub(super) fn read_frames(&mut self) {
        self.reopen_when_due();
        for _ in 0..MAX_CALLS {
            let Some(opened) = self.opened.as_ref().filter(|_| self.head_frame.is_none()) else {
                return;
            };
            match self.buffer.fill(&opened.socket) {
                Ok(()) => {
                    self.advance();
                    if self.state == State::Down {
                        // The interface may be up again, or these frames were queued before it went
                        // down.
                        self.check_device();
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if matches!(self.state, State::Gone(_)) {
                        // All frames that were queued before the device vanished have been taken.
                        self.opened = None;
                    }
                    return;
                }
                // The queue may still contain earlier frames, so try again.
                Err(error) if error.raw_os_error() == Some(libc::ENETDOWN) => self.went_down(),
                Err(error) if error.raw_os_error() == Some(libc::ENODEV) => self.mark_gone(),
                Err(source) => {
                    let (interface, what) = (self.name, "receive");
                    self.failure = Some(SocketCanError::System { interface, what, source });
                    return;
                }
            }
        }
    }

    /// Checks the network device of the socket for changes that the socket did not report.
    pub(super) fn check_device(&mut self) {
        let Some(opened) = &self.opened else { return };
        if matches!(self.state, State::Gone(_)) {
            return;
        }
        match device_state(&opened.socket, self.name) {
            Ok(now) if now.index != opened.device.index => self.mark_gone(),
            Ok(now) if !now.is_up => self.went_down(),
            Ok(_) => self.state = State::Up,
            Err(error) if error.raw_os_error() == Some(libc::ENODEV) => self.mark_gone(),
            Err(_) => {}
        }
    }

    fn went_down(&mut self) {
        if self.state == State::Up {
            self.state = State::Down;
            self.counters.link_down += 1;
            self.failure = Some(SocketCanError::Down { interface: self.name });
        }
    }

    /// Marks the interface as gone. The socket is kept until its queue is empty, because the queue
    /// may contain earlier frames.
    fn mark_gone(&mut self) {
        if self.state == State::Up {
            self.counters.link_down += 1;
        }
        self.state = State::Gone(Retry::after_loss(Instant::now()));
        self.failure = Some(SocketCanError::Gone { interface: self.name });
    }

    fn reopen_when_due(&mut self) {
        let State::Gone(retry) = self.state else { return };
        if self.opened.is_some() || !retry.remaining(Instant::now()).is_zero() {
            return;
        }
        match open(self.name, &self.options) {
            Ok(opened) => {
                self.last_opened = opened.granted();
                self.state = if opened.device.is_up { State::Up } else { State::Down };
                self.opened = Some(opened);
                self.drops = DropCounter::default();
                self.hardware_clock = None;
                self.counters.reopened += 1;
            }
            Err(_) => self.state = State::Gone(retry.after_failure(Instant::now())),
        }
    }

    /// Decodes messages up to the next one that is a frame, and stores it as the head.
    fn advance(&mut self) {
        while let Some(message) = self.buffer.next_message() {
            if let Some(total) = message.control.drops {
                self.counters.queue_drops += self.drops.advance(total);
            }
            match decode(&message) {
                Ok(frame) => {
                    let stamp = stamp_ns(&message, &mut self.hardware_clock);
                    self.counters.stamped_late += u64::from(stamp.is_none());
                    let stamp_ns = stamp.unwrap_or_else(realtime_now_ns);
                    self.head_frame = Some(frame.with_stamp(stamp_ns).on_interface(self.index));
                    return;
                }
                Err(_) => self.counters.passed_over += 1,
            }
        }
    }
}

impl core::fmt::Debug for Link {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:?}", self.report())
    }
}

/// Decodes a message with the layout of `struct can_frame` (16 bytes) or `struct canfd_frame` (72
/// bytes). The fields are the identifier with its flags, the length, the FD flags, two bytes of
/// padding, and the data.
fn decode(message: &Message<'_>) -> Result<Frame, FrameError> {
    let bytes = message.bytes;
    let unknown = FrameError::FdLength { id: FrameId::Standard(0), length: bytes.len() };
    let Some(([a, b, c, d, length, flags, _, _], data)) = bytes.split_first_chunk::<8>() else {
        return Err(unknown);
    };
    let can_id = u32::from_ne_bytes([*a, *b, *c, *d]);
    let id = if can_id & (libc::CAN_EFF_FLAG | libc::CAN_ERR_FLAG) != 0 {
        FrameId::Extended(can_id & libc::CAN_EFF_MASK)
    } else {
        FrameId::Standard(u16::try_from(can_id & libc::CAN_SFF_MASK).unwrap_or(0))
    };
    let data = data.get(..usize::from(*length));
    let has = |flag: libc::c_int| libc::c_int::from(*flags) & flag != 0;
    let frame = match (bytes.len(), data) {
        (libc::CAN_MTU, _) if can_id & libc::CAN_RTR_FLAG != 0 => Frame::remote(id, *length),
        (libc::CAN_MTU, Some(data)) if can_id & libc::CAN_ERR_FLAG != 0 => {
            Frame::new(id, FrameKind::Error, data)
        }
        (libc::CAN_MTU, Some(data)) => Frame::classic(id, data),
        (libc::CANFD_MTU, Some(data)) => {
            let (bit_rate_switch, error_state_indicator) =
                (has(libc::CANFD_BRS), has(libc::CANFD_ESI));
            Frame::new(id, FrameKind::Fd { bit_rate_switch, error_state_indicator }, data)
        }
        _ => Err(unknown),
    }?;
    let direction = if message.sent_here { Direction::Transmitted } else { Direction::Received };
    Ok(frame.with_direction(direction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::socket::ControlData;
    use proptest::prelude::*;

    fn message(bytes: &[u8]) -> Message<'_> {
        Message { bytes, sent_here: false, control: ControlData::default() }
    }

    proptest! {
        #[test]
        fn no_message_makes_it_panic(
            mut bytes in prop::collection::vec(any::<u8>(), 0..80),
            full in any::<Option<bool>>(),
        ) {
            if let Some(fd) = full {
                bytes.resize(if fd { libc::CANFD_MTU } else { libc::CAN_MTU }, 0);
            }
            let _ = decode(&message(&bytes));
        }
    }
}
