//! Options for receiving from SocketCAN.

use crate::frame::FrameId;

/// Options of a [`SocketCanSource`](super::SocketCanSource).
#[derive(Clone, Debug)]
pub struct SocketCanOptions {
    /// True to receive CAN FD frames; every interface must support them.
    pub accepts_fd: bool,
    /// Identifiers of the data frames that the kernel passes; it always passes error frames. `None`
    /// passes all frames. The kernel accepts at most 512 identifiers; a longer list sets no filter.
    pub ids: Option<Vec<FrameId>>,
    /// Requested size of the receive buffer of each interface, as the kernel counts it \[bytes\]. A
    /// queued frame takes [`QUEUED_FRAME_BYTES`] of it. The granted size is
    /// [`LinkReport::receive_buffer_bytes`](super::LinkReport::receive_buffer_bytes).
    pub receive_buffer_bytes: u32,
    /// True to wait for an interface that is missing when the source is opened. It is reported like
    /// an interface that vanished, and opened as soon as it exists.
    pub waits_for_interfaces: bool,
}

/// Size of one queued frame in the receive buffer \[bytes\], measured on Linux 6.
pub const QUEUED_FRAME_BYTES: u32 = 768;

impl Default for SocketCanOptions {
    /// Returns options with CAN FD, all identifiers and a buffer of 8 MiB, which holds two seconds
    /// of a bus with 5,000 frames per second.
    fn default() -> Self {
        Self {
            accepts_fd: true,
            ids: None,
            receive_buffer_bytes: 8 << 20,
            waits_for_interfaces: false,
        }
    }
}
