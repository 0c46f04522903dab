//! A CAN or CAN FD frame with its time stamp.

/// The longest payload of a CAN FD frame \[bytes\].
pub const MAX_PAYLOAD: usize = 64;

/// An identifier with its format (ISO 11898-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FrameId {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

/// What kind of frame it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// Classic CAN data, up to 8 bytes.
    Classic,
    /// CAN FD data, up to 64 bytes.
    Fd {
        /// The payload was sent at the second bit rate.
        bit_rate_switch: bool,
        /// The sender was error passive.
        error_state_indicator: bool,
    },
    /// A classic remote request; carries no data.
    Remote,
    /// An error report of the controller, not a frame of the bus.
    Error,
}

/// Which way a frame went, as the kernel or the log says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the bus.
    Received,
    /// Sent by this host.
    Transmitted,
}

/// One frame. Plain data of fixed size: nothing is allocated for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Arrival time \[ns\] on the source's clock (CLOCK_REALTIME live, the log's own in replay).
    pub stamp_ns: u64,
    /// Index of the interface it came from, in the order the source was configured.
    pub interface: u8,
    /// The identifier.
    pub id: FrameId,
    /// The kind.
    pub kind: FrameKind,
    /// The direction.
    pub direction: Direction,
    /// Valid bytes of `payload`.
    pub length: u8,
    /// The bytes; those beyond `length` are zero.
    pub payload: [u8; MAX_PAYLOAD],
}

impl Frame {
    /// The valid bytes.
    pub fn data(&self) -> &[u8] {
        &self.payload[..usize::from(self.length).min(MAX_PAYLOAD)]
    }
}
