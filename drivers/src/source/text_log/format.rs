//! Detection of the kind of a log by its first line, and conversion of its lines to frames.

use super::asc::{self, AscParser};
use super::stamps::Stamps;
use super::trc::TrcParser;
use super::{LineFault, candump};
use crate::frame::Frame;
use crate::source::InterfaceName;

/// Fewest fields of a row with a frame: its time, identifier, length and data.
const TABLE_FIELDS: usize = 4;

/// Format of a log.
#[derive(Clone, Debug)]
pub(super) enum Format {
    Candump(Stamps),
    Asc(AscParser),
    Trc(TrcParser),
}

impl Format {
    /// Detects the format from the beginning of a log: its first line, or more of it.
    pub(super) fn detect(begin: &[u8]) -> Self {
        let mut lines = begin.trim_ascii_start().split(|byte| *byte == b'\n');
        let line = lines.next().unwrap_or_default().trim_ascii_end();
        let begins = |words: &[&str]| {
            words.iter().any(|word| {
                line.get(..word.len()).is_some_and(|own| own.eq_ignore_ascii_case(word.as_bytes()))
            })
        };
        if line.starts_with(b";") {
            Self::Trc(TrcParser::default())
        } else if begins(&["date ", "base ", "// version", "begin trigger"])
            || asc::is_frame_line(line)
        {
            Self::Asc(AscParser::default())
        } else {
            Self::Candump(Stamps::detect(begin))
        }
    }

    /// Returns true if the stamps are the times since the frame before, which are added.
    pub(super) fn adds_stamps(&self) -> bool {
        matches!(self, Self::Candump(Stamps::SincePrevious { .. }))
    }

    /// Returns true if the last line of the log needs a newline. In the other formats each line
    /// contains its length.
    pub(super) fn ends_lines(&self) -> bool {
        matches!(self, Self::Candump(_))
    }

    /// Returns the frame in a line without its newline. Returns `None` for a header or for another
    /// event than a frame.
    pub(super) fn parse(
        &mut self,
        line: &[u8],
    ) -> Result<Option<(InterfaceName, Frame)>, LineFault> {
        match self {
            // `candump -e` explains an error frame in a line of its own.
            Self::Candump(_) if line.starts_with(b"\t") => Ok(None),
            Self::Candump(stamps) => {
                let (name, frame) =
                    candump::parse(line).map_err(|fault| table_fault(fault, line))?;
                let stamp_ns = stamps.next_ns(frame.stamp_ns)?;
                Ok(Some((name, frame.with_stamp(stamp_ns))))
            }
            Self::Asc(asc) => asc.parse(line),
            Self::Trc(trc) => trc.parse(line),
        }
    }
}

/// Names the row of a table, as the CSV of SavvyCAN or python-can, in place of a missing stamp.
fn table_fault(fault: LineFault, line: &[u8]) -> LineFault {
    let fields = |separator: u8| line.split(|byte| *byte == separator).count();
    let is_row = fields(b',').max(fields(b';')) >= TABLE_FIELDS;
    if fault == LineFault::Stamp && is_row { LineFault::Table } else { fault }
}
