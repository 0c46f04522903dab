//! Whether the ring of raw frames holds a whole window, and the disk holds the ring.

use super::finding::Finding;
use super::machine::space_left;
use super::paths::{existing, megabytes, owned};
use crate::cell::{Cell, CellBus};
use crate::live::recording::recording_folders;
use crate::text::significant;

/// What a frame takes in a recording beside its payload \[bytes\]: 131 with 64 bytes of payload, 75
/// with 8.
const FRAME_BYTES: f64 = 67.0;
/// How long after a window its recording is written at the latest \[s\]: what an identification may
/// take before the result is there.
const LATER_S: f64 = 30.0;

const RING: &str = "service.recordings.ring_mb";
const DIRECTORY: &str = "service.recordings.directory";

/// What is wrong wherever the cell runs.
pub(super) fn check(cell: &Cell, bus: &CellBus, findings: &mut Vec<Finding>) {
    let Some(options) = &cell.service.recordings else { return };
    #[expect(clippy::cast_precision_loss, reason = "at most 10 TB")]
    let ring_s = options.ring_mb as f64 * 1e6 / bytes_per_second(cell, bus);
    let needed_s = cell.window.max_s + options.before_s + options.after_s + LATER_S;
    if ring_s < needed_s {
        findings.push(Finding::warning(
            RING,
            format!(
                "{} MB hold about {} s of this bus; the recording of a window of `window.max_s` is \
                 kept only if they hold {} s: the window, its margins and the identification",
                options.ring_mb,
                significant(ring_s, 2),
                significant(needed_s, 2)
            ),
            "enlarge the ring, or reduce `window.max_s`",
        ));
    }
}

/// What is wrong on this machine.
pub(super) fn check_disk(cell: &Cell, findings: &mut Vec<Finding>) {
    let Some(options) = &cell.service.recordings else { return };
    let folder = options.folder(&cell.service.state_directory);
    for part in [folder.clone()].iter().chain(&recording_folders(&folder)) {
        owned(DIRECTORY, part, cell, findings);
    }
    let there = existing(&folder);
    let Some(left) = space_left(&there) else { return };
    let needed = (options.ring_mb + options.keep_mb).saturating_mul(1_000_000);
    // What an earlier run recorded gives way.
    if left.saturating_add(used(&folder)) < needed {
        findings.push(Finding::warning(
            RING,
            format!(
                "the ring and the kept recordings take up to {} MB, and {} has {} MB left",
                megabytes(needed),
                there.display(),
                megabytes(left)
            ),
            "reduce the ring, or put `service.recordings.directory` on a larger disk",
        ));
    }
}

/// Frames of the layout only; others on the bus are recorded as well where no filter keeps them out.
fn bytes_per_second(cell: &Cell, bus: &CellBus) -> f64 {
    let frames = bus.layout.messages().iter();
    let bytes: f64 =
        frames.map(|message| FRAME_BYTES + f64::from(message.format.wire_length())).sum();
    bytes * cell.sample_rate_hz()
}

/// Bytes in the folder's two folders; what cannot be read does not count.
fn used(folder: &std::path::Path) -> u64 {
    let folders = recording_folders(folder).map(std::fs::read_dir);
    let entries = folders.into_iter().flatten().flatten().flatten();
    entries.filter_map(|entry| entry.metadata().ok()).map(|data| data.len()).sum()
}
