//! Conversion of an object to a frame.

use super::error::ObjectFault;
use crate::frame::{Direction, Frame, FrameId, FrameKind};
use crate::source::InterfaceName;

/// First bytes of an object.
pub(super) const MARK: [u8; 4] = *b"LOBJ";
/// Length of the header that all objects have: mark, length of the header, its version, length of
/// the object and its type \[bytes\].
pub(super) const HEADER_BYTES: usize = 16;

/// Types of objects.
pub(super) const CONTAINER: u32 = 10;
const CAN_MESSAGE: u32 = 1;
const CAN_ERROR: u32 = 2;
const CAN_ERROR_EXTENDED: u32 = 73;
const CAN_MESSAGE_2: u32 = 86;
const CAN_FD_MESSAGE: u32 = 100;
const CAN_FD_MESSAGE_64: u32 = 101;

/// Flag of a stamp that counts 10 µs; without it, it counts nanoseconds.
const TEN_MICROSECONDS: u32 = 1;
/// Flags of a message: sent by the logging computer, and a remote request.
const SENT: u8 = 0x01;
const REMOTE: u8 = 0x80;
/// Flag of a 29-bit identifier.
const EXTENDED: u32 = 0x8000_0000;

/// Returns the type of an object.
pub(super) fn object_type(object: &[u8]) -> Option<u32> {
    u32_at(object, 12)
}

/// Converts an object to a frame with its interface. Returns `None` for objects that are no frames.
///
/// # Errors
/// [`ObjectFault`].
pub(super) fn parse(object: &[u8]) -> Result<Option<(InterfaceName, Frame)>, ObjectFault> {
    let kind = object_type(object).ok_or(ObjectFault::Length)?;
    match kind {
        CAN_MESSAGE | CAN_MESSAGE_2 | CAN_ERROR | CAN_ERROR_EXTENDED | CAN_FD_MESSAGE
        | CAN_FD_MESSAGE_64 => {}
        _ => return Ok(None),
    }
    let (flags, stamp) = u32_at(object, 16).zip(u64_at(object, 24)).ok_or(ObjectFault::Length)?;
    let unit_ns = if flags == TEN_MICROSECONDS { 10_000 } else { 1 };
    let stamp_ns = stamp.saturating_mul(unit_ns);
    // The header of version 2 has the original stamp, too.
    let start = if u16_at(object, 6) == Some(1) { 32 } else { 40 };
    let content = object.get(start..).ok_or(ObjectFault::Length)?;
    let (channel, frame) = match kind {
        CAN_ERROR | CAN_ERROR_EXTENDED => (u16_at(content, 0), Some(Frame::error(0, &[0; 8])?)),
        CAN_FD_MESSAGE => (u16_at(content, 0), fd_frame(content)?),
        CAN_FD_MESSAGE_64 => (content.first().copied().map(u16::from), fd_64_frame(content)?),
        _ => (u16_at(content, 0), classic_frame(content)?),
    };
    let (channel, frame) = channel.zip(frame).ok_or(ObjectFault::Length)?;
    let name = InterfaceName::new(&format!("can{channel}")).map_err(|_| ObjectFault::Channel)?;
    Ok(Some((name, frame.with_stamp(stamp_ns))))
}

/// Parses channel, flags, length, identifier and eight bytes of data.
fn classic_frame(content: &[u8]) -> Result<Option<Frame>, ObjectFault> {
    let [flags, length] = [2, 3].map(|at| content.get(at).copied());
    let (Some(flags), Some(length), Some(id)) = (flags, length, u32_at(content, 4)) else {
        return Ok(None);
    };
    let (id, length) = (frame_id(id), length.min(8));
    let Some(data) = content.get(8..8 + usize::from(length)) else { return Ok(None) };
    let frame = match flags & REMOTE != 0 {
        true => Frame::remote(id, length)?,
        false => Frame::classic(id, data)?,
    };
    Ok(Some(frame.with_direction(direction(flags & SENT != 0))))
}

/// Parses channel, flags, length code, identifier, flags of CAN FD, number of bytes and 64 bytes.
fn fd_frame(content: &[u8]) -> Result<Option<Frame>, ObjectFault> {
    let [flags, fd_flags, length] = [2, 13, 14].map(|at| content.get(at).copied());
    let (Some(flags), Some(fd), Some(length)) = (flags, fd_flags, length) else { return Ok(None) };
    let data = content.get(20..20 + usize::from(length));
    let Some((id, data)) = u32_at(content, 4).zip(data) else { return Ok(None) };
    let kind = frame_kind(fd & 1 != 0, fd & 2 != 0, fd & 4 != 0);
    let frame = Frame::new(frame_id(id), kind, data)?;
    Ok(Some(frame.with_direction(direction(flags & SENT != 0))))
}

/// Parses the newer object of CAN FD, which has only the bytes that the frame has.
fn fd_64_frame(content: &[u8]) -> Result<Option<Frame>, ObjectFault> {
    let [length, sent] = [2, 34].map(|at| content.get(at).copied());
    let (Some(length), Some(sent)) = (length, sent) else { return Ok(None) };
    let (id, fd) = (u32_at(content, 4), u32_at(content, 12));
    let data = content.get(40..40 + usize::from(length));
    let (Some(id), Some(fd), Some(data)) = (id, fd, data) else { return Ok(None) };
    let frame = match fd & 0x10 != 0 {
        true => Frame::remote(frame_id(id), length.min(8))?,
        false => {
            let kind = frame_kind(fd & 0x1000 != 0, fd & 0x2000 != 0, fd & 0x4000 != 0);
            Frame::new(frame_id(id), kind, data)?
        }
    };
    Ok(Some(frame.with_direction(direction(sent != 0))))
}

fn frame_kind(is_fd: bool, bit_rate_switch: bool, error_state_indicator: bool) -> FrameKind {
    match is_fd {
        true => FrameKind::Fd { bit_rate_switch, error_state_indicator },
        false => FrameKind::Classic,
    }
}

fn frame_id(raw: u32) -> FrameId {
    match u16::try_from(raw) {
        Ok(id) if raw & EXTENDED == 0 => FrameId::Standard(id),
        _ => FrameId::Extended(raw & !EXTENDED),
    }
}

fn direction(is_sent: bool) -> Direction {
    if is_sent { Direction::Transmitted } else { Direction::Received }
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().copied().map(u16::from_le_bytes)
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().copied().map(u32::from_le_bytes)
}

pub(super) fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..)?.first_chunk().copied().map(u64::from_le_bytes)
}
