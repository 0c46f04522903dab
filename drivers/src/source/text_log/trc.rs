//! Logs of PEAK's tools (TRC), versions 1.0 to 2.1: header lines after `;`, then one message per
//! line.
//!
//! ```text
//! ;$FILEVERSION=2.1
//! ;$COLUMNS=N,O,T,B,I,d,R,L,D
//!       1      1059.900 DT 1      0300 Rx -  7    00 00 00 00 04 00 00
//! ```
//!
//! Times are milliseconds since the start. Status, events and error counters are skipped.

use super::LineFault;
use super::field::{bytes, channel_name, parse_digits, stamp_ns};
use crate::frame::{Direction, Frame, FrameId, FrameKind};
use crate::source::InterfaceName;

const NS_PER_MS: u64 = 1_000_000;

/// Content of one column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    Time,
    Kind,
    Bus,
    Id,
    Direction,
    Length,
    Data,
    Other,
}

/// Parser of a TRC log, with the columns in their order.
#[derive(Clone, Debug)]
pub(super) struct TrcParser {
    columns: Vec<Column>,
}

impl Default for TrcParser {
    /// Returns a parser for version 1.0, because a file of this version does not declare its
    /// version.
    fn default() -> Self {
        use Column::{Data, Id, Length, Other, Time};
        Self { columns: vec![Other, Time, Id, Length, Data] }
    }
}

impl TrcParser {
    pub(super) fn parse(
        &mut self,
        line: &[u8],
    ) -> Result<Option<(InterfaceName, Frame)>, LineFault> {
        let line = line.trim_ascii();
        if let Some(header) = line.strip_prefix(b";") {
            self.header(header)?;
            return Ok(None);
        }
        if line.is_empty() {
            return Ok(None);
        }
        self.message(line)
    }

    fn header(&mut self, line: &[u8]) -> Result<(), LineFault> {
        use Column::{Bus, Data, Direction, Id, Kind, Length, Other, Time};
        if let Some(version) = line.strip_prefix(b"$FILEVERSION=") {
            self.columns = match version.trim_ascii() {
                b"1.0" => vec![Other, Time, Id, Length, Data],
                b"1.1" => vec![Other, Time, Kind, Id, Length, Data],
                b"1.2" => vec![Other, Time, Bus, Kind, Id, Length, Data],
                b"1.3" => vec![Other, Time, Bus, Kind, Id, Other, Length, Data],
                b"2.0" => vec![Other, Time, Kind, Id, Direction, Length, Data],
                b"2.1" => vec![Other, Time, Kind, Bus, Id, Direction, Other, Length, Data],
                _ => return Err(LineFault::Version),
            };
        }
        if let Some(columns) = line.strip_prefix(b"$COLUMNS=") {
            let column = |name: &[u8]| match name.trim_ascii() {
                b"O" => Time,
                b"T" => Kind,
                b"B" => Bus,
                b"I" => Id,
                b"d" => Direction,
                b"l" | b"L" => Length,
                b"D" => Data,
                _ => Other,
            };
            self.columns = columns.split(|byte| *byte == b',').map(column).collect();
        }
        Ok(())
    }

    fn message(&self, line: &[u8]) -> Result<Option<(InterfaceName, Frame)>, LineFault> {
        let mut fields = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
        let mut bus: &[u8] = b"1";
        let (mut stamp, mut kind, mut id, mut length) = (None, &b"Rx"[..], None, None);
        let mut direction = Direction::Received;
        for column in &self.columns {
            if *column == Column::Data {
                break;
            }
            let field = fields.next().ok_or(LineFault::Length)?;
            match column {
                Column::Time => stamp = Some(stamp_ns(field, NS_PER_MS)?),
                Column::Kind => kind = field,
                Column::Bus => bus = field,
                Column::Id => id = Some(field),
                Column::Direction if field == b"Tx" => direction = Direction::Transmitted,
                Column::Length => length = Some(field),
                Column::Direction | Column::Data | Column::Other => {}
            }
            if is_passed_over(kind) {
                return Ok(None);
            }
        }
        if kind == b"Tx" {
            direction = Direction::Transmitted;
        }
        let stamp_ns = stamp.ok_or(LineFault::Time)?;
        let bus = channel_name(bus).ok_or(LineFault::Interface)?;
        let frame = if matches!(kind, b"ER" | b"Error") {
            Frame::error(0, &[0; 8])?
        } else {
            let id = id.ok_or(LineFault::LogId)?;
            // The number of digits determines the format of the identifier.
            let raw = parse_digits(id, 16).ok_or(LineFault::LogId)?;
            let id = match id.len() {
                ..=4 => u16::try_from(raw).ok().map(FrameId::Standard),
                _ => u32::try_from(raw).ok().map(FrameId::Extended),
            };
            let id = id.ok_or(LineFault::LogId)?;
            let length =
                length.and_then(|length| parse_digits(length, 10)).ok_or(LineFault::Length)?;
            let mut data = fields.peekable();
            if kind == b"RR" || data.peek() == Some(&&b"RTR"[..]) {
                Frame::remote(id, u8::try_from(length).map_err(|_| LineFault::Length)?)?
            } else {
                let (payload, length) = bytes(data, length, 16)?;
                match kind {
                    b"FD" | b"FB" | b"FE" | b"BI" => {
                        let kind = FrameKind::Fd {
                            bit_rate_switch: matches!(kind, b"FB" | b"BI"),
                            error_state_indicator: matches!(kind, b"FE" | b"BI"),
                        };
                        Frame::new(id, kind, &payload[..length])?
                    }
                    _ => Frame::classic(id, &payload[..length])?,
                }
            }
        };
        Ok(Some((bus, frame.with_stamp(stamp_ns).with_direction(direction))))
    }
}

/// Returns true for lines with a status, an event or error counters, in all versions.
fn is_passed_over(kind: &[u8]) -> bool {
    matches!(kind, b"ST" | b"EC" | b"EV" | b"Warng" | b"Status" | b"Event" | b"ErrCt" | b"HwSta")
}
