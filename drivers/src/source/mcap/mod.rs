//! Raw frames in MCAP files (<https://mcap.dev/spec>), recorded by this program.
//!
//! Each interface has one topic, such as `/can/can0`. Each message is one frame as ROS 2 CDR with
//! the schema `didim_msgs/msg/CanFrame`. The file contains the schema (`ros2msg`), so that Foxglove
//! and PlotJuggler can show the frames without knowing this program. The schema is specific to this
//! program for three reasons. `can_msgs/msg/Frame` has no CAN FD. `ros2_socketcan_msgs/msg/FdFrame`
//! has neither the second bit rate nor remote requests. Neither of them has the direction of a
//! frame.
//!
//! `log_time` is CLOCK_REALTIME and meant for people. The stamps of the assembler are `log_time`
//! minus the constant `offset_ns` of the metadata record `didim`, exact to the nanosecond.
//! `sequence` counts the frames of the bus over all interfaces, including frames that were dropped
//! unread or not recorded. A gap in it means missing frames, and the source reports them
//! ([`SourceCounters::queue_drops`](super::SourceCounters)).
//!
//! A file for viewers also contains the curves of the joints, as [`JointState`]s assembled from
//! these frames. The source does not read them.
//!
//! Frames of other recorders in ROS 2 bags (`can_msgs/msg/Frame`,
//! `ros2_socketcan_msgs/msg/FdFrame`) are read, too. Their topic stands for the interface.
//!
//! Chunks of the ring are not compressed, those of kept recordings are (zstd). All contain their
//! CRC. A recorder that was killed leaves a file without an end. Such a file is read up to its last
//! complete chunk.

mod bytes;
mod content;
mod error;
mod info;
mod joint_states;
mod message;
mod reader;
mod records;
mod repair;
mod ros_frame;
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

/// Longest record that is read \[bytes\]. It limits the memory of the reader. Other programs write
/// chunks of a megabyte.
const MAX_RECORD: u64 = 32 << 20;

/// Prefix of the topics of frames.
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
