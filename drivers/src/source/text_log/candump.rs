//! Conversion of one line of a log to one frame.

use super::field::{NS_PER_S, bytes, parse_digits, stamp_ns};
use super::{ERROR_FLAG, FLAG_BRS, FLAG_ESI, FLAG_FDF, LineFault};
use crate::frame::{Direction, Frame, FrameId, FrameKind, MAX_PAYLOAD};
use crate::source::InterfaceName;

/// Days from 1 March of year 0 to 1 January 1970.
const DAYS_TO_1970: u64 = 719_468;

/// Parses a line without its newline. Returns the name of the interface and the frame. The
/// interface index of the frame is 0.
pub(super) fn parse(line: &[u8]) -> Result<(InterfaceName, Frame), LineFault> {
    let line = line.trim_ascii_end();
    if line.is_empty() {
        return Err(LineFault::Empty);
    }
    let mut fields = line.split(|&byte| byte == b' ').filter(|field| !field.is_empty());
    let first = fields.next().ok_or(LineFault::Stamp)?;
    let stamp_ns = match first.contains(&b'-') {
        true => parse_date(first, fields.next().unwrap_or_default())?,
        false => parse_stamp(first)?,
    };
    let name = fields.next().and_then(InterfaceName::from_bytes).ok_or(LineFault::Interface)?;
    let field = fields.next().ok_or(LineFault::Frame)?;
    if !field.contains(&b'#') {
        let frame = parse_screen_frame(field, &mut fields)?;
        return Ok((name, frame.with_stamp(stamp_ns)));
    }
    let frame = parse_frame(field)?;
    let direction = match fields.next() {
        None | Some(b"R") => Direction::Received,
        Some(b"T") => Direction::Transmitted,
        Some(_) => return Err(LineFault::Direction),
    };
    match fields.next() {
        None => Ok((name, frame.with_stamp(stamp_ns).with_direction(direction))),
        Some(_) => Err(LineFault::Direction),
    }
}

/// Parses `(seconds.fraction)` with up to nine digits of fraction, exactly, in integers.
fn parse_stamp(field: &[u8]) -> Result<u64, LineFault> {
    let inside = field.strip_prefix(b"(").and_then(|rest| rest.strip_suffix(b")"));
    let inside = inside.ok_or(LineFault::Stamp)?;
    if !inside.contains(&b'.') {
        return Err(LineFault::Stamp);
    }
    stamp_ns(inside, NS_PER_S).map_err(|fault| match fault {
        LineFault::Time => LineFault::Stamp,
        fault => fault,
    })
}

/// Parses a date and a time of `candump -tA`, `(2026-05-01` and `12:00:00.000000)`, as UTC.
fn parse_date(date: &[u8], time: &[u8]) -> Result<u64, LineFault> {
    let date = date.strip_prefix(b"(").ok_or(LineFault::Stamp)?;
    let time = time.strip_suffix(b")").ok_or(LineFault::Stamp)?;
    let numbers = |field: &[u8], between: u8| -> Option<[u64; 3]> {
        let parts = field.split(|byte| *byte == between);
        let numbers: Option<Vec<u64>> = parts.map(|part| parse_digits(part, 10)).collect();
        numbers?.try_into().ok()
    };
    let seconds_at = time.iter().rposition(|byte| *byte == b':').ok_or(LineFault::Stamp)? + 1;
    let within_minute = stamp_ns(time.get(seconds_at..).unwrap_or_default(), NS_PER_S)?;
    let clock = time.get(..seconds_at.saturating_sub(1)).unwrap_or_default();
    let clock = numbers(&[clock, b":0"].concat(), b':').ok_or(LineFault::Stamp)?;
    let [year, month, day] = numbers(date, b'-').ok_or(LineFault::Stamp)?;
    let is_date = (1970..=2500).contains(&year) && (1..=12).contains(&month) && day >= 1;
    if !is_date || day > 31 || clock[0] > 23 || clock[1] > 59 {
        return Err(LineFault::Stamp);
    }
    // Days since 1 March of year 0 in the Gregorian calendar, whose year begins with March here.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    let seconds = (days - DAYS_TO_1970) * 86_400 + clock[0] * 3600 + clock[1] * 60;
    Ok(seconds * NS_PER_S + within_minute)
}

/// Parses a frame as candump shows it on the screen: `181   [8]  37 12 00 00 00 00 00 00`, with
/// the direction before it (`RX - -`) where `-x` asked for it. A length of two digits is CAN FD.
fn parse_screen_frame<'a>(
    first: &'a [u8],
    fields: &mut impl Iterator<Item = &'a [u8]>,
) -> Result<Frame, LineFault> {
    let (mut id, mut direction, mut flags) = (first, Direction::Received, [false; 2]);
    if matches!(first, b"RX" | b"TX") {
        direction = if first == b"TX" { Direction::Transmitted } else { Direction::Received };
        let mut flag = |letter: &[u8]| fields.next().is_some_and(|field| field == letter);
        flags = [flag(b"B"), flag(b"E")];
        id = fields.next().ok_or(LineFault::Frame)?;
    }
    let [bit_rate_switch, error_state_indicator] = flags;
    let (id, error) = parse_id(id)?;
    let length = fields.next().and_then(|field| field.strip_prefix(b"[")?.strip_suffix(b"]"));
    let length = length.ok_or(LineFault::Frame)?;
    let is_fd = length.len() == 2;
    let length = parse_digits(length, 10).ok_or(LineFault::Frame)?;
    let mut fields = fields.peekable();
    if fields.peek() == Some(&&b"remote"[..]) {
        return Ok(Frame::remote(id, u8::try_from(length).unwrap_or(u8::MAX))?);
    }
    let (payload, length) = bytes(fields, length, 16)?;
    let kind = match (error, is_fd) {
        (true, _) => FrameKind::Error,
        (false, true) => FrameKind::Fd { bit_rate_switch, error_state_indicator },
        (false, false) => FrameKind::Classic,
    };
    Ok(Frame::new(id, kind, &payload[..length])?.with_direction(direction))
}

/// Parses a frame in one of the forms `ID#DATA`, `ID#R` and `ID##FDATA`.
fn parse_frame(field: &[u8]) -> Result<Frame, LineFault> {
    let hash = field.iter().position(|&byte| byte == b'#').ok_or(LineFault::Frame)?;
    let (id, body) = (&field[..hash], &field[hash + 1..]);
    let (id, error) = parse_id(id)?;
    match body {
        [b'#' | b'R', ..] if error => Err(LineFault::ErrorForm),
        [b'#', rest @ ..] => parse_fd(id, rest),
        [b'R', length @ ..] => parse_remote(id, length),
        data if error => Ok(Frame::new(id, FrameKind::Error, Payload::parse(data)?.bytes())?),
        data => parse_classic(id, data),
    }
}

/// Parses an identifier. Returns true for that of an error frame.
fn parse_id(id: &[u8]) -> Result<(FrameId, bool), LineFault> {
    let raw = parse_digits(id, 16).and_then(|raw| u32::try_from(raw).ok()).ok_or(LineFault::Id)?;
    // The number of digits, and not the value, determines the format of the identifier. A flag in
    // the identifier marks an error frame.
    Ok(match id.len() {
        3 => (FrameId::Standard(u16::try_from(raw).map_err(|_| LineFault::Id)?), false),
        8 if raw & ERROR_FLAG != 0 => (FrameId::Extended(raw & !ERROR_FLAG), true),
        8 => (FrameId::Extended(raw), false),
        _ => return Err(LineFault::Id),
    })
}

fn parse_fd(id: FrameId, body: &[u8]) -> Result<Frame, LineFault> {
    let (&digit, data) = body.split_first().ok_or(LineFault::FdFlags)?;
    let flags = nibble(digit).ok_or(LineFault::FdFlags)?;
    if flags & !(FLAG_BRS | FLAG_ESI | FLAG_FDF) != 0 {
        return Err(LineFault::FdFlags);
    }
    let kind = FrameKind::Fd {
        bit_rate_switch: flags & FLAG_BRS != 0,
        error_state_indicator: flags & FLAG_ESI != 0,
    };
    Ok(Frame::new(id, kind, Payload::parse(data)?.bytes())?)
}

fn parse_remote(id: FrameId, length: &[u8]) -> Result<Frame, LineFault> {
    let length = match length {
        [] => 0,
        [digit @ b'0'..=b'8'] => digit - b'0',
        _ => return Err(LineFault::RemoteLength),
    };
    Ok(Frame::remote(id, length)?)
}

fn parse_classic(id: FrameId, data: &[u8]) -> Result<Frame, LineFault> {
    // A controller can report a data length code above 8 for a frame of eight bytes. The code is no
    // data.
    let (data, code) = match data.iter().position(|&byte| byte == b'_') {
        Some(at) => (&data[..at], Some(&data[at + 1..])),
        None => (data, None),
    };
    let payload = Payload::parse(data)?;
    match code {
        None => {}
        Some([b'9' | b'A'..=b'F' | b'a'..=b'f']) if payload.bytes().len() == 8 => {}
        Some(_) => return Err(LineFault::RawLengthCode),
    }
    Ok(Frame::classic(id, payload.bytes())?)
}

/// Data bytes of a frame. There may be more of them than the kind of frame allows.
struct Payload {
    bytes: [u8; MAX_PAYLOAD],
    length: usize,
}

impl Payload {
    fn parse(digits: &[u8]) -> Result<Self, LineFault> {
        let mut payload = Self { bytes: [0; MAX_PAYLOAD], length: 0 };
        let (pairs, rest) = digits.as_chunks::<2>();
        if !rest.is_empty() {
            return Err(LineFault::Data);
        }
        for &[high, low] in pairs {
            // The older `.` between bytes is not accepted, because `candump -l` and `-L` do not
            // write it.
            let byte = nibble(high).zip(nibble(low)).map(|(high, low)| high << 4 | low);
            let place = payload.bytes.get_mut(payload.length).ok_or(LineFault::Data)?;
            *place = byte.ok_or(LineFault::Data)?;
            payload.length += 1;
        }
        Ok(payload)
    }

    fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

fn nibble(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(line: &str) -> Frame {
        parse(line.as_bytes()).unwrap().1
    }

    fn fault(line: &str) -> LineFault {
        parse(line.as_bytes()).unwrap_err()
    }

    #[test]
    fn stamps_keep_every_digit() {
        for (stamp, ns) in [
            ("(1436509052.249713)", 1_436_509_052_249_713_000),
            ("(1436509052.249713001)", 1_436_509_052_249_713_001),
            ("(0.5)", 500_000_000),
            ("(0000000000.000001)", 1_000),
            // More digits than a double can hold.
            ("(9007199254.740993123)", 9_007_199_254_740_993_123),
            ("(18446744073.709551615)", u64::MAX),
        ] {
            assert_eq!(parse_stamp(stamp.as_bytes()), Ok(ns), "{stamp}");
        }
        assert_eq!(parse_stamp(b"(18446744073.709551616)"), Err(LineFault::StampRange));
        assert_eq!(parse_stamp(b"(99999999999999999999999.0)"), Err(LineFault::StampRange));
    }

    #[test]
    fn every_form_of_frame() {
        let read = frame("(1436509052.249713) can0 123#1122AABB");
        let made = Frame::classic(FrameId::Standard(0x123), &[0x11, 0x22, 0xAA, 0xBB]).unwrap();
        assert_eq!(read, made.with_stamp(1_436_509_052_249_713_000));

        let read = frame("(0.0) can0 123##1112233 T");
        assert_eq!(read.direction, Direction::Transmitted);
        assert_eq!(read.data(), [0x11, 0x22, 0x33]);
        let kind = FrameKind::Fd { bit_rate_switch: true, error_state_indicator: false };
        assert_eq!(read.kind, kind);

        let read = frame("(0.0) can0 20000004#000C000000000000 R");
        assert!(read.is_error());
        assert_eq!((read.id.number(), read.length), (4, 8));

        assert_eq!(frame("(0.0) can0 123#R").length, 0);
        assert_eq!(frame("(0.0) can0 123#R4").length, 4);
        assert_eq!(frame("(0.0) can0 00000123#").id, FrameId::Extended(0x123));
        assert_eq!(frame("(0.0) can0 123#1122334455667788_e\r").length, 8);
        assert_eq!(parse(b"(0.0) slcan0 123#").unwrap().0.as_str(), "slcan0");
    }

    #[test]
    fn every_corruption_has_its_name() {
        for (line, expected) in [
            ("", LineFault::Empty),
            ("  \r", LineFault::Empty),
            ("can0 123#11", LineFault::Stamp),
            ("(12) can0 123#11", LineFault::Stamp),
            ("(1.) can0 123#11", LineFault::Stamp),
            ("(-1.0) can0 123#11", LineFault::Stamp),
            ("(1.0000000001) can0 123#11", LineFault::Stamp),
            ("(1.0)", LineFault::Interface),
            ("(1.0) a_name_of_16_byte 123#11", LineFault::Interface),
            ("(1.0) can0", LineFault::Frame),
            ("(1.0) can0 123 [2] 11", LineFault::Bytes),
            ("(1.0) can0 123 [2 11 22", LineFault::Frame),
            ("(1.0) can0 123 2 11 22", LineFault::Frame),
            ("(1.0) can0 1234 [1] 11", LineFault::Id),
            ("(2024-13-01 12:00:00.0) can0 123#", LineFault::Stamp),
            ("(2024-05-01 25:00:00.0) can0 123#", LineFault::Stamp),
            ("(2024-05-01) can0 123#", LineFault::Stamp),
            ("(1.0) can0 12#11", LineFault::Id),
            ("(1.0) can0 12345#11", LineFault::Id),
            ("(1.0) can0 12G#11", LineFault::Id),
            ("(1.0) can0 +12#11", LineFault::Id),
            ("(1.0) can0 123#1", LineFault::Data),
            ("(1.0) can0 123#1x", LineFault::Data),
            ("(1.0) can0 123##", LineFault::FdFlags),
            ("(1.0) can0 123##8", LineFault::FdFlags),
            ("(1.0) can0 123#R9", LineFault::RemoteLength),
            ("(1.0) can0 123#11_9", LineFault::RawLengthCode),
            ("(1.0) can0 20000004##0", LineFault::ErrorForm),
            ("(1.0) can0 20000004#R", LineFault::ErrorForm),
            ("(1.0) can0 123#11 X", LineFault::Direction),
            ("(1.0) can0 123#11 R T", LineFault::Direction),
        ] {
            assert_eq!(fault(line), expected, "{line:?}");
        }
        for impossible in
            ["800#11", "40000000#11", "123#112233445566778899", "123##0112233445566778899"]
        {
            let line = format!("(1.0) can0 {impossible}");
            assert!(matches!(fault(&line), LineFault::Impossible(_)), "{line:?}");
        }
    }

    #[test]
    fn what_candump_shows_on_the_screen_is_read() {
        let logged = frame("(1714564800.000133) can0 181#37120000000000FF");
        for shown in [
            " (1714564800.000133)  can0  181   [8]  37 12 00 00 00 00 00 FF",
            " (2024-05-01 12:00:00.000133)  can0  181   [8]  37 12 00 00 00 00 00 FF   '7.......'",
            " (1714564800.000133)  can0  RX - -  181   [8]  37 12 00 00 00 00 00 FF",
        ] {
            assert_eq!(frame(shown), logged, "{shown}");
        }
        assert_eq!(frame("(0.0)  can0  080   [0]  "), frame("(0.0) can0 080#"));
        let fd = frame("(0.0)  can0  TX B -  123  [02]  11 22");
        assert_eq!(fd, frame("(0.0) can0 123##11122 T"));
        assert_eq!(frame("(0.0)  can0  123   [2]  remote request"), frame("(0.0) can0 123#R2"));
        let error = "(0.0)  can0  20000004   [8]  00 0C 00 00 00 00 00 00   ERRORFRAME";
        assert_eq!(frame(error), frame("(0.0) can0 20000004#000C000000000000"));
        assert_eq!(frame("(1970-01-01 00:00:01.5) can0 123#").stamp_ns, 1_500_000_000);
        assert_eq!(frame("(2000-02-29 00:00:00.0) can0 123#").stamp_ns, 951_782_400_000_000_000);
    }

    proptest! {
        #[test]
        fn no_line_makes_it_panic(line in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&line);
        }

        #[test]
        fn no_corruption_to_a_good_line_makes_it_panic(at in 0usize..60, byte in any::<u8>()) {
            let mut line =
                b"(1436509052.249713) can0 18FF1234##1112233445566778899AABBCC T".to_vec();
            if let Some(place) = line.get_mut(at) {
                *place = byte;
            }
            let _ = parse(&line);
            let _ = parse(&line[..at]);
        }
    }
}
