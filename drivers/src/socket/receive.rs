//! Reception of many frames with one system call.

#![allow(unsafe_code, reason = "recvmmsg: neither std nor socketcan offers it")]

use std::io;

use super::Socket;
use super::control::{CONTROL_BYTES, ControlData};
use crate::frame::MAX_PAYLOAD;

/// Maximum number of frames received by one call. At 5 kHz with one frame per cycle, they are 12 ms
/// of the bus.
const BATCH_FRAMES: usize = 64;

/// Size of `struct canfd_frame` \[bytes\]. A classic frame consists of the first 16 of them.
const CAN_BYTES: usize = 8 + MAX_PAYLOAD;

/// Size of the longest Ethernet frame \[bytes\]: the header, 1500 bytes of data, and space for
/// tags.
pub(crate) const PACKET_BYTES: usize = 1536;

/// Memory into which the kernel writes one frame. It is aligned for `struct cmsghdr`.
#[derive(Clone, Copy)]
#[repr(C, align(8))]
struct Slot<const BYTES: usize> {
    control: [u8; CONTROL_BYTES],
    frame: [u8; BYTES],
    /// Number of bytes in `frame` that the kernel has written.
    length: usize,
    /// Number of bytes in `control` that the kernel has written.
    control_length: usize,
    flags: libc::c_int,
}

impl<const BYTES: usize> Slot<BYTES> {
    const EMPTY: Self = Self {
        control: [0; CONTROL_BYTES],
        frame: [0; BYTES],
        length: 0,
        control_length: 0,
        flags: 0,
    };
}

/// One received message with the data of the kernel about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Message<'a> {
    /// Content of the message. It is a `struct can_frame` or a `struct canfd_frame`, distinguished
    /// by its length, or an Ethernet frame.
    pub(crate) bytes: &'a [u8],
    /// True if this host sent the message (MSG_DONTROUTE), through this or another socket.
    pub(crate) sent_here: bool,
    /// Stamps of the message, and the number of dropped messages.
    pub(crate) control: ControlData,
}

/// Buffer for the frames that were received from one socket and not yet returned. All memory is
/// allocated at the start.
pub(crate) struct ReceiveBuffer<const BYTES: usize = CAN_BYTES> {
    slots: Box<[Slot<BYTES>]>,
    filled_slots: usize,
    next_slot: usize,
}

impl<const BYTES: usize> ReceiveBuffer<BYTES> {
    pub(crate) fn new() -> Self {
        Self {
            slots: vec![Slot::EMPTY; BATCH_FRAMES].into_boxed_slice(),
            filled_slots: 0,
            next_slot: 0,
        }
    }

    /// Reads the messages that wait in the socket, without blocking. Call it after the last frame
    /// was returned.
    #[allow(clippy::unnecessary_cast, reason = "the types differ between C libraries")]
    pub(crate) fn fill(&mut self, socket: &Socket) -> io::Result<()> {
        (self.filled_slots, self.next_slot) = (0, 0);
        // SAFETY: iovec and mmsghdr are integers and pointers; zero and null are valid values.
        let mut vectors: [libc::iovec; BATCH_FRAMES] = unsafe { core::mem::zeroed() };
        // SAFETY: as above.
        let mut headers: [libc::mmsghdr; BATCH_FRAMES] = unsafe { core::mem::zeroed() };
        let parts = headers.iter_mut().zip(&mut vectors).zip(&mut self.slots);
        for ((header, vector), slot) in parts {
            vector.iov_base = slot.frame.as_mut_ptr().cast();
            vector.iov_len = BYTES;
            header.msg_hdr.msg_iov = vector;
            header.msg_hdr.msg_iovlen = 1;
            header.msg_hdr.msg_control = slot.control.as_mut_ptr().cast();
            header.msg_hdr.msg_controllen = CONTROL_BYTES as _;
        }
        let count = u32::try_from(BATCH_FRAMES).unwrap_or(0);
        // SAFETY: `headers` holds `count` headers; each points to its own vector, frame and control
        // bytes with their true sizes. All of them outlive the call, nothing else accesses them
        // during it, and the kernel writes plain bytes. The timeout may be null.
        let received = unsafe {
            libc::recvmmsg(
                socket.raw_descriptor(),
                headers.as_mut_ptr(),
                count,
                libc::MSG_DONTWAIT as _,
                core::ptr::null_mut(),
            )
        };
        let Ok(received) = usize::try_from(received) else {
            return Err(io::Error::last_os_error());
        };
        for (slot, header) in self.slots.iter_mut().zip(&headers).take(received) {
            slot.length = (header.msg_len as usize).min(BYTES);
            slot.control_length = (header.msg_hdr.msg_controllen as usize).min(CONTROL_BYTES);
            slot.flags = header.msg_hdr.msg_flags;
        }
        self.filled_slots = received.min(BATCH_FRAMES);
        Ok(())
    }

    /// Returns the oldest message that was not yet returned.
    pub(crate) fn next_message(&mut self) -> Option<Message<'_>> {
        let slot = self.slots.get(self.next_slot).filter(|_| self.next_slot < self.filled_slots)?;
        self.next_slot += 1;
        Some(Message {
            bytes: slot.frame.get(..slot.length)?,
            sent_here: slot.flags & libc::MSG_DONTROUTE != 0,
            control: ControlData::parse(slot.control.get(..slot.control_length)?),
        })
    }

    /// Returns true if the last [`Self::fill`] ended because this buffer was full.
    pub(crate) fn was_full(&self) -> bool {
        self.filled_slots == BATCH_FRAMES
    }
}
