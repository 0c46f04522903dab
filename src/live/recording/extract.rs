//! Extraction of a time range of the ring as a separate recording.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use didim_drivers::source::mcap::{McapInfo, McapScan, McapWriteError};
use didim_drivers::source::{McapError, McapSource, McapWriter};

use super::curves::JointCurves;
use super::ring::segments;
use crate::files::replace;

/// Range of stamps including both ends \[ns\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TimeRange {
    /// Start of the wanted range.
    pub(super) from_ns: u64,
    /// Start of the required range.
    pub(super) first_ns: u64,
    /// End of the required range.
    pub(super) last_ns: u64,
    /// End of the wanted range.
    pub(super) to_ns: u64,
}

/// Reason why no frames were extracted.
#[derive(Debug, thiserror::Error)]
pub(super) enum ExtractError {
    #[error("the ring {}: {cause}", folder.display())]
    Ring { folder: PathBuf, cause: io::Error },
    #[error("not in the ring: overwritten, the ring is too small, or nothing was recorded then")]
    NotThere,
    #[error(transparent)]
    Read(#[from] McapError),
    #[error("{}: {cause}", path.display())]
    Write { path: PathBuf, cause: McapWriteError },
}

/// The ring files that contain a time range.
#[derive(Debug)]
pub(super) struct FoundFiles {
    files: Vec<(PathBuf, McapScan)>,
    time_range: TimeRange,
    /// Latest stamp of the recorder run on disk \[ns\].
    pub(super) newest_ns: u64,
    /// Maximum size of the frames in the extracted recording \[bytes\].
    pub(super) frame_bytes: u64,
}

impl FoundFiles {
    /// Returns the maximum size of the extracted recording \[bytes\].
    pub(super) fn bytes(&self, curves: &JointCurves) -> u64 {
        let TimeRange { from_ns, to_ns, .. } = self.time_range;
        self.frame_bytes + curves.bytes(to_ns.min(self.newest_ns).saturating_sub(from_ns))
    }
}

/// Recorder runs in which a time range is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RunChoice {
    /// The latest run that had begun before the required range. The last frames of the range may
    /// reach the disk soon.
    Latest,
    /// Any run that contains the range, the latest first. The acquisition may have been restarted
    /// since the range.
    Any,
}

/// Finds the ring files of a time range. Returns `None` if the required range is not on disk yet or
/// no longer.
pub(super) fn find(
    ring: &Path,
    stretch: TimeRange,
    runs: RunChoice,
) -> Result<Option<FoundFiles>, ExtractError> {
    let mut files: Vec<(PathBuf, McapScan)> = Vec::new();
    let (mut run, mut newest_ns, mut begun) = (None, 0, false);
    for (path, scan) in newest_first(ring)? {
        let (Some(info), Some((first, last))) = (&scan.info, scan.stamps_ns()) else { continue };
        if run.as_ref() != Some(&info.recorder_run) {
            if begun && (newest_ns >= stretch.last_ns || runs == RunChoice::Latest) {
                break;
            }
            begun = false;
            run = Some(info.recorder_run.clone());
            newest_ns = last;
            files.clear();
        }
        newest_ns = newest_ns.max(last);
        begun |= first <= stretch.first_ns;
        if last >= stretch.from_ns && first <= stretch.to_ns {
            files.push((path, scan));
        }
        if first <= stretch.from_ns && (newest_ns >= stretch.last_ns || runs == RunChoice::Latest) {
            break;
        }
    }
    if !begun || newest_ns < stretch.last_ns || files.is_empty() {
        return Ok(None);
    }
    files.reverse();
    let overhead = 16 * 1024;
    let frame_bytes =
        files.iter().map(|(_, scan)| overlapping_bytes(scan, stretch)).sum::<u64>() + overhead;
    Ok(Some(FoundFiles { files, time_range: stretch, newest_ns, frame_bytes }))
}

/// Returns the latest stamp on disk of the latest recorder run \[ns\].
pub(super) fn newest_stamp(ring: &Path) -> Result<Option<u64>, ExtractError> {
    let mut scans = newest_first(ring)?;
    Ok(scans.find_map(|(_, scan)| scan.stamps_ns()).map(|(_, last)| last))
}

/// Returns the readable ring files, newest first. Files that are removed in the meantime are
/// skipped.
fn newest_first(ring: &Path) -> Result<impl Iterator<Item = (PathBuf, McapScan)>, ExtractError> {
    let failed = |cause| ExtractError::Ring { folder: ring.to_owned(), cause };
    let segments = segments(ring).map_err(failed)?;
    Ok(segments.into_iter().rev().filter_map(|segment| {
        let scan = McapScan::read(&segment.path);
        // The file being written gets its final name when it is complete.
        let (path, scan) = match scan {
            Ok(scan) => (segment.path, scan),
            Err(_) if segment.is_part() => {
                let complete = segment.path.with_extension("");
                let scan = McapScan::read(&complete).ok()?;
                (complete, scan)
            }
            Err(_) => return None,
        };
        Some((path, scan))
    }))
}

fn overlapping_bytes(scan: &McapScan, stretch: TimeRange) -> u64 {
    let Some(info) = &scan.info else { return 0 };
    let overlaps = scan.chunks.iter().filter(|chunk| {
        info.stamp_ns(chunk.last_log_time) >= stretch.from_ns
            && info.stamp_ns(chunk.first_log_time) <= stretch.to_ns
    });
    // Each chunk is followed by its index, which has 16 bytes per message. The summary has another
    // entry per chunk.
    overlaps.map(|chunk| (chunk.end_offset - chunk.offset) * 3 / 2 + 512).sum()
}

/// Writes the frames of a time range and the joint curves into a file, and returns the number of
/// frames. `more` is added to the metadata of the file.
pub(super) fn extract(
    found: &FoundFiles,
    path: &Path,
    more: &BTreeMap<String, String>,
    curves: &JointCurves,
) -> Result<u64, ExtractError> {
    let mut failed = None;
    let replaced = replace(path, |out| {
        copy(found, out, path, more, curves.clone()).map_err(|error| {
            failed = Some(error);
            io::ErrorKind::Other.into()
        })
    });
    let refused =
        |cause| ExtractError::Write { path: path.to_owned(), cause: McapWriteError::Output(cause) };
    replaced.map_err(|cause| failed.unwrap_or_else(|| refused(cause)))
}

fn copy(
    found: &FoundFiles,
    out: &mut dyn io::Write,
    path: &Path,
    more: &BTreeMap<String, String>,
    mut curves: JointCurves,
) -> Result<u64, ExtractError> {
    let failed = |cause| ExtractError::Write { path: path.to_owned(), cause };
    let (mut out, mut writer) = (Some(out), None::<McapWriter<&mut dyn io::Write>>);
    for (file, _) in &found.files {
        let interfaces = writer.as_ref().map_or(&[][..], |writer| &writer.info().interfaces);
        let mut source = open(file, interfaces)?;
        let Some(info) = source.info().cloned() else { continue };
        if let Some(out) = out.take() {
            let info = McapInfo { additional_entries: more.clone(), ..info };
            let begun = McapWriter::compressed(out, &info).map_err(failed)?;
            writer = Some(begun.with_joints(curves.names()).map_err(failed)?);
        }
        let Some(writer) = &mut writer else { continue };
        while let Some(frame) = source.next_frame()? {
            let stretch = found.time_range;
            if (stretch.from_ns..=stretch.to_ns).contains(&frame.stamp_ns) {
                let sequence = source.last_sequence().unwrap_or(0);
                curves.write(&frame, sequence, writer).map_err(failed)?;
            }
        }
    }
    let mut writer = writer.ok_or(ExtractError::NotThere)?;
    curves.finish(&mut writer).map_err(failed)?;
    let frames = writer.frames();
    writer.finish().map_err(failed)?;
    Ok(frames)
}

/// Opens a file of the ring, even if it is being renamed.
fn open(
    path: &Path,
    interfaces: &[didim_drivers::source::InterfaceName],
) -> Result<McapSource, McapError> {
    match McapSource::open(path, interfaces) {
        Err(McapError::Open { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            McapSource::open(&path.with_extension(""), interfaces)
        }
        opened => opened,
    }
}
