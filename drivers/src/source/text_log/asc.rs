//! Logs of Vector's tools (ASC): a header, then one event per line.
//!
//! ```text
//! date Mon Nov 23 10:00:00.000 am 2026
//! base hex  timestamps absolute
//!    0.015991 1  123             Rx   d 8 11 22 33 44 55 66 77 88
//!    0.016991 1  18FF1234x       Tx   d 2 11 22
//!    0.017991 CANFD   1 Rx  123  Name  1 0 9 12 11 22 33 44 55 66 77 88 99 AA BB CC
//!    0.018991 1  ErrorFrame
//! ```
//!
//! Other events (statistics, triggers, other buses) are skipped.

use super::LineFault;
use super::field::{NS_PER_S, bytes, channel_name, parse_digits, stamp_ns};
use crate::frame::{Direction, Frame, FrameId, FrameKind};
use crate::source::InterfaceName;

/// Flag of a frame of CAN FD, in the flags of a `CANFD` line.
const FLAG_EXTENDED_DATA_LENGTH: u64 = 0x1000;

/// Returns true if the first line is a frame of a log without a header.
pub(super) fn is_frame_line(begin: &[u8]) -> bool {
    let line = begin.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let fields: Vec<&[u8]> =
        line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty()).take(4).collect();
    let [time, channel, third, fourth] = fields[..] else { return false };
    let is_time = stamp_ns(time, NS_PER_S).is_ok() && time.contains(&b'.');
    let is_fd = channel == b"CANFD" && channel_name(third).is_some();
    is_time && parse_direction(fourth).is_some() && (is_fd || channel_name(channel).is_some())
}

/// Parser of an ASC log, with the settings of the header. If stamps are relative to the previous
/// line, the parser also stores the time of that line.
#[derive(Clone, Debug)]
pub(super) struct AscParser {
    base: u32,
    has_relative_stamps: bool,
    now_ns: u64,
}

impl Default for AscParser {
    fn default() -> Self {
        Self { base: 16, has_relative_stamps: false, now_ns: 0 }
    }
}

impl AscParser {
    pub(super) fn parse(
        &mut self,
        line: &[u8],
    ) -> Result<Option<(InterfaceName, Frame)>, LineFault> {
        let mut fields = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
        let Some(first) = fields.next() else { return Ok(None) };
        if first.eq_ignore_ascii_case(b"base") {
            let words: Vec<&[u8]> = fields.collect();
            let has = |word: &[u8]| words.iter().any(|own| own.eq_ignore_ascii_case(word));
            self.base = if has(b"dec") { 10 } else { 16 };
            self.has_relative_stamps = has(b"relative");
            return Ok(None);
        }
        if !first.iter().all(|byte| byte.is_ascii_digit() || *byte == b'.') {
            return Ok(None);
        }
        let stamp = stamp_ns(first, NS_PER_S)?;
        self.now_ns = match self.has_relative_stamps {
            true => self.now_ns.checked_add(stamp).ok_or(LineFault::StampRange)?,
            false => stamp,
        };
        let parsed = match fields.next() {
            Some(b"CANFD") => self.parse_fd(fields)?,
            Some(number) => match channel_name(number) {
                Some(channel) => self.parse_classic(channel, fields)?,
                None => None,
            },
            None => None,
        };
        Ok(parsed.map(|(channel, frame)| (channel, frame.with_stamp(self.now_ns))))
    }

    fn parse_classic<'a>(
        &self,
        channel: InterfaceName,
        mut fields: impl Iterator<Item = &'a [u8]>,
    ) -> Result<Option<(InterfaceName, Frame)>, LineFault> {
        let Some(id) = fields.next() else { return Ok(None) };
        if id == b"ErrorFrame" {
            let frame = Frame::error(0, &[0; 8])?;
            return Ok(Some((channel, frame)));
        }
        // A transmit request is not a frame; the transmitted frame follows in another line.
        let Some(direction) = fields.next().and_then(parse_direction) else { return Ok(None) };
        let id = self.parse_id(id)?;
        let kind = fields.next();
        let length = fields.next().and_then(|length| parse_digits(length, 16));
        let length = length.filter(|length| *length <= 15).map(|length| length.min(8));
        let frame = match (kind, length) {
            (Some(b"d"), Some(length)) => {
                let (payload, length) = bytes(fields, length, self.base)?;
                Frame::classic(id, &payload[..length])?
            }
            (Some(b"r"), length) => {
                let length = u8::try_from(length.unwrap_or(0)).map_err(|_| LineFault::Length)?;
                Frame::remote(id, length)?
            }
            _ => return Err(LineFault::Length),
        };
        Ok(Some((channel, frame.with_direction(direction))))
    }

    fn parse_fd<'a>(
        &self,
        mut fields: impl Iterator<Item = &'a [u8]>,
    ) -> Result<Option<(InterfaceName, Frame)>, LineFault> {
        let Some(channel) = fields.next().and_then(channel_name) else { return Ok(None) };
        let Some(direction) = fields.next().and_then(parse_direction) else { return Ok(None) };
        let Some(id) = fields.next() else { return Err(LineFault::Id) };
        if id == b"ErrorFrame" {
            return Ok(Some((channel, Frame::error(0, &[0; 8])?.with_direction(direction))));
        }
        let id = self.parse_id(id)?;
        // A name may precede the flags of the frame.
        let flag = |field: Option<&[u8]>| match field {
            Some(b"0") => Some(false),
            Some(b"1") => Some(true),
            _ => None,
        };
        let first = fields.next();
        let bit_rate_switch = flag(first).or_else(|| flag(fields.next()));
        let error_state_indicator = flag(fields.next());
        let flags = bit_rate_switch.zip(error_state_indicator);
        let (bit_rate_switch, error_state_indicator) = flags.ok_or(LineFault::Length)?;
        // Skip the data length code. The data bytes follow it.
        fields.next();
        let length =
            fields.next().and_then(|length| parse_digits(length, 10)).ok_or(LineFault::Length)?;
        let (payload, length) = bytes(fields.by_ref(), length, self.base)?;
        // Duration and length on the bus precede the flags. Without flags the line is of CAN FD.
        let flags = fields.nth(2).and_then(|flags| parse_digits(flags, 16));
        let kind = match flags {
            Some(flags) if flags & FLAG_EXTENDED_DATA_LENGTH == 0 => FrameKind::Classic,
            _ => FrameKind::Fd { bit_rate_switch, error_state_indicator },
        };
        Ok(Some((channel, Frame::new(id, kind, &payload[..length])?.with_direction(direction))))
    }

    fn parse_id(&self, field: &[u8]) -> Result<FrameId, LineFault> {
        let (digits, extended) = match field.split_last() {
            Some((b'x' | b'X', digits)) => (digits, true),
            _ => (field, false),
        };
        let id = parse_digits(digits, self.base).ok_or(LineFault::LogId)?;
        let standard = u16::try_from(id).map(FrameId::Standard);
        let extended_id = u32::try_from(id).map(FrameId::Extended);
        if extended {
            extended_id.map_err(|_| LineFault::LogId)
        } else {
            standard.map_err(|_| LineFault::LogId)
        }
    }
}

fn parse_direction(field: &[u8]) -> Option<Direction> {
    match field {
        b"Rx" => Some(Direction::Received),
        b"Tx" => Some(Direction::Transmitted),
        _ => None,
    }
}
