//! Message that contains one frame, as ROS 2 CDR (OMG DDSI-RTPS, little-endian), and its schema.

use super::bytes::ByteReader;
use super::error::Corruption;
use crate::frame::{Direction, Frame, FrameId, FrameKind};

pub(super) const SCHEMA_NAME: &str = "didim_msgs/msg/CanFrame";
pub(super) const SCHEMA_ENCODING: &str = "ros2msg";
pub(super) const MESSAGE_ENCODING: &str = "cdr";

/// Schema in the format of ROS 2 message definitions.
pub(super) const SCHEMA: &str = "\
# One frame of a CAN bus. The topic names the interface.
uint32 id                    # 11 or 29 bits; of an error frame its class (linux/can/error.h)
bool is_extended             # 29 bits
bool is_rtr                  # remote request
bool is_error                # report of the controller, not a frame of the bus
bool is_fd                   # CAN FD
bool bit_rate_switch         # CAN FD: the payload had the second bit rate
bool error_state_indicator   # CAN FD: the sender was error passive
bool is_transmitted          # sent by the recording host
uint8 length                 # bytes of data; of a remote request the bytes asked for
uint8[<=64] data
";

/// Encapsulation header: CDR, little-endian, no options.
pub(super) const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Number of bytes of a message before the data of the frame.
pub(super) const HEAD_BYTES: usize = 4 + 16;

/// Appends the message of a frame.
pub(super) fn encode(frame: &Frame, out: &mut Vec<u8>) {
    let (is_fd, switched, passive) = match frame.kind {
        FrameKind::Fd { bit_rate_switch, error_state_indicator } => {
            (true, bit_rate_switch, error_state_indicator)
        }
        _ => (false, false, false),
    };
    let data = frame.data();
    out.extend_from_slice(&ENCAPSULATION);
    out.extend_from_slice(&frame.id.number().to_le_bytes());
    out.extend_from_slice(&[
        u8::from(matches!(frame.id, FrameId::Extended(_))),
        u8::from(frame.kind == FrameKind::Remote),
        u8::from(frame.is_error()),
        u8::from(is_fd),
        u8::from(switched),
        u8::from(passive),
        u8::from(frame.direction == Direction::Transmitted),
        frame.length,
    ]);
    out.extend_from_slice(&u32::try_from(data.len()).unwrap_or(0).to_le_bytes());
    out.extend_from_slice(data);
}

/// Returns the frame of a message, with time 0 and interface 0.
pub(super) fn decode(message: &[u8]) -> Result<Frame, Corruption> {
    let malformed = Corruption::Malformed("message");
    let Some((id, flags, length, data)) = split_head(message) else { return Err(malformed) };
    let [is_extended, is_rtr, is_error, is_fd, bit_rate_switch, error_state_indicator, sent] =
        flags;
    let kind = match (is_rtr, is_error, is_fd) {
        (false, false, false) => FrameKind::Classic,
        (true, false, false) => FrameKind::Remote,
        (false, true, false) => FrameKind::Error,
        (false, false, true) => FrameKind::Fd { bit_rate_switch, error_state_indicator },
        _ => return Err(malformed),
    };
    let id = match u16::try_from(id) {
        _ if is_extended => FrameId::extended(id)?,
        Ok(id) => FrameId::standard(id)?,
        Err(_) => return Err(crate::frame::FrameError::IdRange { id, bits: 11 }.into()),
    };
    let frame = match kind {
        FrameKind::Remote if data.is_empty() => Frame::remote(id, length)?,
        FrameKind::Error if !is_extended => return Err(malformed),
        _ if usize::from(length) != data.len() => return Err(malformed),
        kind => Frame::new(id, kind, data)?,
    };
    Ok(frame.with_direction(if sent { Direction::Transmitted } else { Direction::Received }))
}

fn split_head(message: &[u8]) -> Option<(u32, [bool; 7], u8, &[u8])> {
    let mut bytes = ByteReader(message);
    if bytes.take(4)? != ENCAPSULATION {
        return None;
    }
    let id = bytes.take_u32()?;
    let mut flags = [false; 7];
    for flag in &mut flags {
        *flag = match bytes.take_u8()? {
            0 => false,
            1 => true,
            _ => return None,
        };
    }
    let length = bytes.take_u8()?;
    let data = bytes.take_block()?;
    // A CDR writer may pad the end to four bytes.
    (data.len() <= 64 && bytes.0.len() < 4).then_some((id, flags, length, data))
}
