//! How to listen to SocketCAN.

use crate::frame::FrameId;

/// How to listen.
#[derive(Clone, Debug)]
pub struct SocketCanOptions {
    /// Receive CAN FD frames; every interface must be able to carry them.
    pub fd: bool,
    /// Let the kernel pass only data frames with these identifiers (and error frames). Nothing
    /// given passes everything. The kernel takes at most 512; more are passed unfiltered.
    pub ids: Option<Vec<FrameId>>,
    /// The receive buffer wanted per interface \[bytes, as the kernel accounts them\]; a queued
    /// frame costs [`QUEUED_FRAME_BYTES`]. See [`LinkReport::receive_buffer_bytes`](super::LinkReport::receive_buffer_bytes) for what was
    /// granted.
    pub receive_buffer_bytes: u32,
}

/// What one queued frame costs of the receive buffer \[bytes\], measured on Linux 6.
pub const QUEUED_FRAME_BYTES: u32 = 768;

impl Default for SocketCanOptions {
    /// CAN FD, every identifier, and 8 MiB: two seconds of a 5 kHz bus.
    fn default() -> Self {
        Self { fd: true, ids: None, receive_buffer_bytes: 8 << 20 }
    }
}
