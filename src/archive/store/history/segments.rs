//! The closed parts of the history, compressed: `history-00000007.jsonl.zst`, oldest first.

use std::fs::{self, File};
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use ruzstd::decoding::StreamingDecoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

use crate::files::replace;

const PREFIX: &str = "history-";
const SUFFIX: &str = ".jsonl.zst";

/// Returns the path of a segment in a results folder.
pub(super) fn segment_path(folder: &Path, number: u64) -> PathBuf {
    folder.join(format!("{PREFIX}{number:08}{SUFFIX}"))
}

/// Returns true if a file has the name of a segment.
pub(super) fn is_segment(name: &str) -> bool {
    number_of(name).is_some()
}

fn number_of(name: &str) -> Option<u64> {
    let number = name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?.parse().ok()?;
    (format!("{PREFIX}{number:08}{SUFFIX}") == name).then_some(number)
}

/// Returns the numbers of the segments in a results folder, in ascending order. A missing folder
/// has none.
///
/// # Errors
/// Those of the file system.
pub(super) fn segment_numbers(folder: &Path) -> io::Result<Vec<u64>> {
    let entries = match fs::read_dir(folder) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut numbers = Vec::new();
    for entry in entries {
        numbers.extend(entry?.file_name().to_str().and_then(number_of));
    }
    numbers.sort_unstable();
    Ok(numbers)
}

/// Opens a segment for reading its lines.
///
/// # Errors
/// Those of the file system, and of a damaged file.
pub(super) fn open_segment(folder: &Path, number: u64) -> io::Result<Box<dyn Read + Send>> {
    let file = BufReader::new(File::open(segment_path(folder, number))?);
    let decoder = StreamingDecoder::new(file);
    Ok(Box::new(decoder.map_err(|cause| io::Error::new(io::ErrorKind::InvalidData, cause))?))
}

/// Writes a segment, completely or not at all.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_segment(folder: &Path, number: u64, lines: &[u8]) -> io::Result<()> {
    // The compressor cannot report a failure of its output.
    let compressed = compress_to_vec(lines, CompressionLevel::Fastest);
    replace(&segment_path(folder, number), |out| out.write_all(&compressed))
}
