//! Raw frames in MCAP files (<https://mcap.dev/spec>), recorded by this program.
//!
//! Each interface has one topic, `/can/can0`. Each message is one frame as ROS 2 CDR with the
//! schema `didim_msgs/msg/CanFrame`. The file contains the schema (`ros2msg`), so that Foxglove and
//! PlotJuggler show it without knowing this program. `can_msgs/msg/Frame` has no CAN FD.
//! `ros2_socketcan_msgs/msg/FdFrame` has neither the second bit rate nor remote requests. Neither
//! has the direction of a frame. So the schema is specific to this program.
//!
//! `log_time` is CLOCK_REALTIME, for people. The stamps of the assembler are `log_time` minus the
//! constant `offset_ns` of the metadata record `didim`, to the nanosecond. `sequence` counts the
//! frames of the bus over all interfaces, including frames that were dropped unread or not
//! recorded. A jump of it means missing frames, and the source reports it
//! ([`SourceCounters::queue_drops`](super::SourceCounters)).
//!
//! A file for viewers also has the curves of the joints, [`JointState`]s assembled from these
//! frames. They are not read again.
//!
//! Chunks are not compressed and carry their CRC. A file without an end, from a recorder that was
//! killed, is read up to its last complete chunk.

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

pub use error::{Corruption, McapError};
pub use info::{METADATA_NAME, McapInfo};
pub use joint_states::JointState;
pub use reader::McapSource;
pub use records::FileEnd;
pub use repair::{Repair, RepairError, repair_recording};
pub use scan::{ChunkSpan, McapScan};
pub use write::{McapWriteError, McapWriter};

/// First bytes of a file, and last bytes of a complete one.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Longest record that is read \[bytes\]: the bound of the reader's memory. Other programs write
/// chunks of a megabyte.
const MAX_RECORD: u64 = 32 << 20;

/// Prefix of topics.
const TOPIC_PREFIX: &str = "/can/";

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
