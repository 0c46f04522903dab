//! Options for receiving from SocketCAN.

use crate::frame::FrameId;

/// Options of listening.
#[derive(Clone, Debug)]
pub struct SocketCanOptions {
    /// True to receive CAN FD frames; every interface must support them.
    pub accepts_fd: bool,
    /// Identifiers of the data frames that the kernel passes, in addition to error frames. `None`
    /// passes everything. The kernel accepts at most 512; a longer list sets no filter.
    pub ids: Option<Vec<FrameId>>,
    /// Requested receive buffer per interface \[bytes, as the kernel accounts them\]; a queued
    /// frame costs [`QUEUED_FRAME_BYTES`]. The granted size is
    /// [`LinkReport::receive_buffer_bytes`](super::LinkReport::receive_buffer_bytes).
    pub receive_buffer_bytes: u32,
}

/// Size of one queued frame in the receive buffer \[bytes\], measured on Linux 6.
pub const QUEUED_FRAME_BYTES: u32 = 768;

impl Default for SocketCanOptions {
    /// Returns CAN FD, every identifier, and 8 MiB: two seconds of a 5 kHz bus.
    fn default() -> Self {
        Self { accepts_fd: true, ids: None, receive_buffer_bytes: 8 << 20 }
    }
}
