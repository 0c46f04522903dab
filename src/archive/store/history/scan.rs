//! Lines of a file of the history.

use std::io::{self, BufRead, BufReader, Read};

use serde::Deserialize;

use super::line::{HISTORY_SCHEMA, HistoryLine};
use crate::archive::skipped_lines::SkippedLines;

/// Maximum length of a line \[bytes\]. A line with 1,000 parameters and a note has a tenth of it.
pub(super) const MAX_LINE: u64 = 1 << 20;

/// Content of a history file.
#[derive(Debug, Default)]
pub(super) struct HistoryContent {
    /// Number of bytes up to the end of the last complete line.
    pub(super) complete_bytes: u64,
    /// Length of the file \[bytes\].
    pub(super) length: u64,
    /// Number of complete lines of this program, including those of a later version.
    pub(super) lines: usize,
    /// Unreadable lines, including those of a later version.
    pub(super) skipped: SkippedLines,
    /// Result number of the last line of this program, if the line contains it.
    pub(super) last_result: Option<u64>,
}

/// Fields that exist in every version of a line.
#[derive(Deserialize)]
struct VersionFields {
    schema: u32,
    #[serde(default)]
    result: Option<u64>,
}

/// Parses a line of this program: its result number and its content. The content is `None` if a
/// later version wrote the line. An older program, installed again, cannot read such a line and
/// keeps it.
pub(super) fn parse_line(text: &[u8]) -> Option<(Option<u64>, Option<HistoryLine>)> {
    let line: Option<HistoryLine> = serde_json::from_slice(text).ok();
    let VersionFields { schema, result } = match &line {
        Some(line) => VersionFields { schema: line.schema, result: Some(line.result) },
        None => serde_json::from_slice(text).ok()?,
    };
    match schema {
        HISTORY_SCHEMA => line.map(|line| (result, Some(line))),
        later if later > HISTORY_SCHEMA => Some((result, None)),
        _ => None,
    }
}

/// Calls a function with the bytes of every line of this program. The function also gets the parsed
/// line, unless a later version wrote it.
pub(super) fn scan(
    file: impl Read,
    mut take: impl FnMut(&[u8], Option<HistoryLine>),
) -> io::Result<HistoryContent> {
    let mut reader = BufReader::new(file);
    let (mut scan, mut line) = (HistoryContent::default(), Vec::new());
    for number in 1.. {
        line.clear();
        // A longer line is read in pieces. No piece is a valid line.
        let read = (&mut reader).take(MAX_LINE).read_until(b'\n', &mut line)?;
        if read == 0 {
            break;
        }
        scan.length += read as u64;
        let is_complete = line.ends_with(b"\n");
        if is_complete {
            scan.complete_bytes = scan.length;
        }
        match parse_line(&line).filter(|_| is_complete) {
            Some((result, context)) => {
                scan.lines += 1;
                scan.last_result = result;
                if context.is_none() {
                    scan.skipped.add(number);
                }
                take(&line, context);
            }
            None => scan.skipped.add(number),
        }
    }
    Ok(scan)
}
