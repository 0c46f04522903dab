//! Frames as ROS 2 has them: `can_msgs/msg/Frame` and `ros2_socketcan_msgs/msg/FdFrame`, in CDR.

use super::bytes::ByteReader;
use super::error::Corruption;
use crate::frame::{Frame, FrameId, FrameKind};
use crate::source::InterfaceName;

/// Longest name of an interface \[bytes\].
const INTERFACE_BYTES: usize = 15;

/// Type of a message with a frame of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RosFrame {
    /// `can_msgs/msg/Frame`.
    Classic,
    /// `ros2_socketcan_msgs/msg/FdFrame`.
    Fd,
}

impl RosFrame {
    /// Returns the type of a schema, or `None` for other messages.
    pub(super) fn from_schema(name: &str) -> Option<Self> {
        match name {
            "can_msgs/msg/Frame" => Some(Self::Classic),
            "ros2_socketcan_msgs/msg/FdFrame" => Some(Self::Fd),
            _ => None,
        }
    }

    /// Returns the frame of a message, with the stamp of its header. A stamp of 0 is replaced by
    /// the time of the recording.
    pub(super) fn decode(self, message: &[u8], log_time_ns: u64) -> Result<Frame, Corruption> {
        let fields = Fields::read(self, message).ok_or(Corruption::Malformed("message"))?;
        let id = match u16::try_from(fields.id) {
            _ if fields.is_extended || fields.is_error => FrameId::extended(fields.id)?,
            Ok(id) => FrameId::standard(id)?,
            Err(_) => {
                let id = fields.id;
                return Err(crate::frame::FrameError::IdRange { id, bits: 11 }.into());
            }
        };
        let fd = FrameKind::Fd { bit_rate_switch: false, error_state_indicator: false };
        let frame = match self {
            _ if fields.is_error => Frame::new(id, FrameKind::Error, fields.data)?,
            Self::Classic if fields.is_rtr => {
                Frame::remote(id, u8::try_from(fields.data.len()).unwrap_or(u8::MAX))?
            }
            Self::Classic => Frame::new(id, FrameKind::Classic, fields.data)?,
            Self::Fd => Frame::new(id, fd, fields.data)?,
        };
        Ok(frame.with_stamp(if fields.stamp_ns > 0 { fields.stamp_ns } else { log_time_ns }))
    }
}

/// Fields of a message.
struct Fields<'a> {
    stamp_ns: u64,
    id: u32,
    is_rtr: bool,
    is_extended: bool,
    is_error: bool,
    data: &'a [u8],
}

impl<'a> Fields<'a> {
    fn read(kind: RosFrame, message: &'a [u8]) -> Option<Self> {
        let mut bytes = ByteReader(message);
        // CDR, little-endian. Whatever writes big-endian is no rosbag2.
        if bytes.take(4)? != super::message::ENCAPSULATION {
            return None;
        }
        let length = bytes.0.len();
        let (sec, nanosec) = (bytes.take_u32()?, bytes.take_u32()?);
        let stamp_ns = u64::from(sec) * 1_000_000_000 + u64::from(nanosec);
        bytes.take_block()?;
        let padding = (length - bytes.0.len()).next_multiple_of(4) - (length - bytes.0.len());
        bytes.take(padding)?;
        let id = bytes.take_u32()?;
        let mut flag = || Some(bytes.take_u8()? != 0);
        let is_rtr = kind == RosFrame::Classic && flag()?;
        let (is_extended, is_error) = (flag()?, flag()?);
        let data_length = usize::from(bytes.take_u8()?);
        let data = match kind {
            RosFrame::Classic => bytes.take(8)?.get(..data_length)?,
            RosFrame::Fd => {
                // The sequence's own length is aligned.
                let used = length - bytes.0.len();
                bytes.take(used.next_multiple_of(4) - used)?;
                bytes.take_block()?.get(..data_length)?
            }
        };
        Some(Self { stamp_ns, id, is_rtr, is_extended, is_error, data })
    }
}

/// Returns the name of the interface for a topic: `/can1/from_can_bus` is `from_can_bus` if it is
/// longer than the name of an interface can be.
pub(super) fn interface_of(topic: &str) -> Option<InterfaceName> {
    let name = topic.trim_matches('/').replace('/', "_");
    let start = name.len().saturating_sub(INTERFACE_BYTES);
    InterfaceName::new(name.get(start..)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message with a frame identifier of the header of 4 letters, as CDR.
    fn message(rest: &[u8]) -> Vec<u8> {
        let mut message = vec![0, 1, 0, 0, 2, 0, 0, 0, 7, 0, 0, 0, 5, 0, 0, 0];
        message.extend(b"can0\0\0\0\0");
        message.extend(rest);
        message
    }

    #[test]
    fn frames_of_ros_are_frames() {
        let classic = message(b"\x81\x01\0\0\0\0\0\x03abc\0\0\0\0\0");
        let frame = RosFrame::Classic.decode(&classic, 9).unwrap();
        let id = FrameId::standard(0x181).unwrap();
        assert_eq!((frame.id, frame.data(), frame.stamp_ns), (id, &b"abc"[..], 2_000_000_007));
        let fd = message(b"\x81\x01\0\0\x01\0\x0c\0\x0c\0\0\0abcdefghijkl");
        let frame = RosFrame::Fd.decode(&fd, 9).unwrap();
        let id = FrameId::extended(0x181).unwrap();
        assert_eq!((frame.id, frame.data()), (id, &b"abcdefghijkl"[..]));
        assert!(matches!(frame.kind, FrameKind::Fd { .. }));
        let remote = message(b"\x81\x01\0\0\x01\0\0\x03\0\0\0\0\0\0\0\0");
        assert_eq!(RosFrame::Classic.decode(&remote, 9).unwrap().kind, FrameKind::Remote);
        for end in 0..classic.len() {
            assert!(RosFrame::Classic.decode(&classic[..end], 9).is_err(), "{end}");
        }
        let topics = ["/from_can_bus", "/left/can1/from_can_bus", "//"]
            .map(|topic| interface_of(topic).map(|name| name.as_str().to_owned()));
        assert_eq!(
            topics.each_ref().map(Option::as_deref),
            [Some("from_can_bus"), Some("n1_from_can_bus"), None]
        );
    }
}
