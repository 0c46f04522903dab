//! Writer of frames to a log that `canplayer` and this crate read.

use std::io::Write;

use super::{ERROR_FLAG, FLAG_BRS, FLAG_ESI, MAX_LINE};
use crate::frame::{Direction, Frame, FrameKind};
use crate::source::InterfaceName;

/// Number of digits of the written stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampDigits {
    /// Stamps in microseconds, the default of candump. Smaller digits are truncated.
    Microseconds,
    /// Stamps in nanoseconds, as with `candump -N`. No digit is lost.
    Nanoseconds,
}

/// Writer of a log with one line per frame. Frames that this host sent have the direction mark `T`.
#[derive(Debug)]
pub struct CandumpWriter<W: Write> {
    out: W,
    interfaces: Vec<InterfaceName>,
    digits: StampDigits,
    buffer: Vec<u8>,
}

impl<W: Write> CandumpWriter<W> {
    /// Creates a writer with the output `out`. The interface index of a frame selects a name in
    /// `interfaces`.
    pub fn new(out: W, interfaces: &[InterfaceName], digits: StampDigits) -> Self {
        let buffer = Vec::with_capacity(MAX_LINE);
        Self { out, interfaces: interfaces.to_vec(), digits, buffer }
    }

    /// Writes the line of one frame.
    ///
    /// # Errors
    /// [`WriteError::NoInterface`] if the interface index has no name; [`WriteError::Output`] if
    /// the output fails.
    pub fn write(&mut self, frame: &Frame) -> Result<(), WriteError> {
        let index = frame.interface;
        let name = self.interfaces.get(usize::from(index));
        let name = name.ok_or(WriteError::NoInterface { index })?;
        self.buffer.clear();
        write_line(&mut self.buffer, name, frame, self.digits)?;
        Ok(self.out.write_all(&self.buffer)?)
    }

    /// Flushes the output and returns it.
    ///
    /// # Errors
    /// [`WriteError::Output`]; the log is then not complete.
    pub fn finish(mut self) -> Result<W, WriteError> {
        self.out.flush()?;
        Ok(self.out)
    }
}

fn write_line(
    out: &mut Vec<u8>,
    name: &InterfaceName,
    frame: &Frame,
    digits: StampDigits,
) -> std::io::Result<()> {
    let (seconds, nanoseconds) = (frame.stamp_ns / 1_000_000_000, frame.stamp_ns % 1_000_000_000);
    match digits {
        StampDigits::Microseconds => write!(out, "({seconds:010}.{:06})", nanoseconds / 1_000)?,
        StampDigits::Nanoseconds => write!(out, "({seconds:010}.{nanoseconds:09})")?,
    }
    write!(out, " {name} ")?;
    match frame.kind {
        FrameKind::Error => write!(out, "{:08X}#", frame.id.number() | ERROR_FLAG)?,
        FrameKind::Classic => write!(out, "{}#", frame.id)?,
        FrameKind::Remote if frame.length == 0 => write!(out, "{}#R", frame.id)?,
        FrameKind::Remote => write!(out, "{}#R{}", frame.id, frame.length)?,
        FrameKind::Fd { bit_rate_switch, error_state_indicator } => {
            let switched = if bit_rate_switch { FLAG_BRS } else { 0 };
            let passive = if error_state_indicator { FLAG_ESI } else { 0 };
            write!(out, "{}##{:X}", frame.id, switched | passive)?;
        }
    }
    for byte in frame.data() {
        write!(out, "{byte:02X}")?;
    }
    out.write_all(match frame.direction {
        Direction::Received => b"\n",
        Direction::Transmitted => b" T\n",
    })
}

/// Reason why a frame could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The interface index of the frame has no name. Create the writer with the interface names of
    /// the source.
    #[error("a frame of interface {index} cannot be written: no name was given for it")]
    NoInterface {
        /// Interface index of the frame.
        index: u8,
    },
    /// The output failed, so the log is not complete.
    #[error("cannot write the log: {0}")]
    Output(#[from] std::io::Error),
}

#[cfg(test)]
mod tests {
    use super::super::candump;
    use super::*;
    use crate::frame::FrameId;
    use proptest::prelude::*;

    fn text(frame: &Frame, digits: StampDigits) -> String {
        let name = [InterfaceName::new("can0").unwrap()];
        let mut writer = CandumpWriter::new(Vec::new(), &name, digits);
        writer.write(frame).unwrap();
        String::from_utf8(writer.finish().unwrap()).unwrap()
    }

    #[test]
    fn lines_are_those_of_candump() {
        let id = FrameId::Standard(0x123);
        let stamped = |frame: Frame| frame.with_stamp(1_436_509_052_249_713_001);
        let classic = stamped(Frame::classic(id, &[0x11, 0x22, 0xAA, 0xBB]).unwrap());
        let micro = |frame: &Frame| text(frame, StampDigits::Microseconds);
        assert_eq!(micro(&classic), "(1436509052.249713) can0 123#1122AABB\n");
        assert_eq!(
            text(&classic, StampDigits::Nanoseconds),
            "(1436509052.249713001) can0 123#1122AABB\n"
        );
        let sent = Frame::fd(id, true, &[0x11]).unwrap().with_direction(Direction::Transmitted);
        assert_eq!(micro(&sent), "(0000000000.000000) can0 123##111 T\n");
        let remote = Frame::remote(FrameId::Extended(0x123), 4).unwrap();
        assert_eq!(micro(&remote), "(0000000000.000000) can0 00000123#R4\n");
        let error = Frame::error(4, &[0, 0xC]).unwrap();
        assert_eq!(micro(&error), "(0000000000.000000) can0 20000004#000C\n");
    }

    #[test]
    fn an_interface_without_a_name_is_an_error() {
        let frame = Frame::error(4, &[]).unwrap().on_interface(1);
        let mut writer = CandumpWriter::new(Vec::new(), &[], StampDigits::Nanoseconds);
        assert!(matches!(writer.write(&frame), Err(WriteError::NoInterface { index: 1 })));
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        let id = prop_oneof![
            (0u16..0x800).prop_map(FrameId::Standard),
            (0u32..0x2000_0000).prop_map(FrameId::Extended)
        ];
        let data = prop::collection::vec(any::<u8>(), 0..=64);
        (id, data, any::<[bool; 3]>(), 0..4, any::<u64>()).prop_map(
            |(id, data, flags, kind, stamp)| {
                let short = &data[..data.len().min(8)];
                let longest = (0..=data.len()).rev().find(|&n| crate::frame::is_fd_length(n));
                let fd =
                    FrameKind::Fd { bit_rate_switch: flags[0], error_state_indicator: flags[1] };
                let frame = match kind {
                    0 => Frame::classic(id, short),
                    1 => Frame::remote(id, u8::try_from(short.len()).unwrap()),
                    2 => Frame::error(id.number(), short),
                    _ => Frame::new(id, fd, &data[..longest.unwrap_or(0)]),
                };
                let direction = if flags[2] { Direction::Transmitted } else { Direction::Received };
                frame.unwrap().with_stamp(stamp).with_direction(direction)
            },
        )
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(frame in any_frame()) {
            let written = text(&frame, StampDigits::Nanoseconds);
            let (name, read) = candump::parse(written.trim_end().as_bytes()).unwrap();
            prop_assert_eq!(name.as_str(), "can0");
            prop_assert_eq!(read, frame);
        }
    }
}
