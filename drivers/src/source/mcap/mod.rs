//! Raw frames in MCAP files (<https://mcap.dev/spec>), as this program records them.
//!
//! One topic for each interface, `/can/can0`; each message is one frame as ROS 2 CDR with the schema
//! `didim_msgs/msg/CanFrame`, which stands in the file (`ros2msg`), so that Foxglove and PlotJuggler
//! show it without knowing this program. `can_msgs/msg/Frame` has no CAN FD and
//! `ros2_socketcan_msgs/msg/FdFrame` neither the second bit rate nor remote requests; neither tells
//! which way a frame went. So the schema is our own.
//!
//! `log_time` is CLOCK_REALTIME, for people. The stamps that the assembler saw are `log_time` minus
//! the constant `offset_ns` of the metadata record `didim`, to the nanosecond. `sequence` counts the
//! frames of the bus over all interfaces, those that were dropped unread or not recorded among them:
//! where it skips, frames are missing, and the source says so
//! ([`SourceCounters::queue_drops`](super::SourceCounters)).
//!
//! A file that was made for people to look at has the curves of the joints as well, [`JointState`]s
//! assembled from these frames: they are not read again.
//!
//! Chunks are not compressed and carry their CRC. A file without an end, of a recorder that was
//! killed, is read up to its last whole chunk.

mod bytes;
mod content;
mod error;
mod info;
mod joint_states;
mod message;
mod reader;
mod records;
mod repair;
mod scan;
mod write;

pub use error::{Damage, McapError};
pub use info::{METADATA_NAME, McapInfo};
pub use joint_states::JointState;
pub use reader::McapSource;
pub use records::FileEnd;
pub use repair::{Repair, RepairError, repair};
pub use scan::{ChunkSpan, McapScan};
pub use write::{McapWriteError, McapWriter};

/// The first bytes of a file, and the last of one that is whole.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// The longest record that is read \[bytes\]: the bound of the reader's memory. Other programs write
/// chunks of a megabyte.
const MAX_RECORD: u64 = 32 << 20;

/// What topics begin with.
const TOPIC: &str = "/can/";

/// Opcodes of records (the specification's table).
mod op {
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const METADATA: u8 = 0x0C;
    pub(super) const DATA_END: u8 = 0x0F;
}
