//! Check that the ring of raw frames holds a complete window, and that the disk holds the ring.

use super::finding::Finding;
use super::limits::CheckLimits;
use super::machine::space_left;
use super::paths::{RESULT_BYTES, check_owner, existing_parent, megabytes};
use crate::cell::{Cell, CellBus};
use crate::live::recording::{WriteKind, recording_folders, share_bytes};
use crate::text::significant_digits;

/// Size of a frame in a recording without its payload \[bytes\]: 131 with 64 bytes of payload, 75
/// with 8.
const FRAME_BYTES: f64 = 67.0;

const BUDGET_KEY: &str = "service.write_mb_per_day";
const RING_KEY: &str = "service.recordings.ring_mb";
const DIRECTORY_KEY: &str = "service.recordings.directory";

/// Finds problems that do not depend on the machine.
pub(super) fn check(cell: &Cell, bus: &CellBus, findings: &mut Vec<Finding>) {
    let Some(options) = &cell.service.recordings else { return };
    #[expect(clippy::cast_precision_loss, reason = "at most 10 TB")]
    let ring_s = options.ring_mb as f64 * 1e6 / bytes_per_second(cell, bus);
    check_budget(cell, bytes_per_second(cell, bus), findings);
    let needed_s = cell.window.max_s
        + options.before_s
        + options.after_s
        + CheckLimits::DEFAULT.extraction_delay_s;
    if ring_s < needed_s {
        findings.push(Finding::warning(
            RING_KEY,
            format!(
                "{} MB hold about {} s of this bus; the recording of a window of `window.max_s` is \
                 kept only if they hold {} s: the window, its margins and the identification",
                options.ring_mb,
                significant_digits(ring_s, 2),
                significant_digits(needed_s, 2)
            ),
            "enlarge the ring, or reduce `window.max_s`",
        ));
    }
}

/// Finds a budget of written data that is too small for the ring.
fn check_budget(cell: &Cell, bytes_per_second: f64, findings: &mut Vec<Finding>) {
    let Some(megabytes) = cell.service.write_mb_per_day else { return };
    #[expect(clippy::cast_precision_loss, reason = "at most 100 TB")]
    let budget_mb = share_bytes(megabytes * 1_000_000, WriteKind::Ring) as f64 / 1e6;
    let day_mb = bytes_per_second * 86_400.0 / 1e6;
    if day_mb > budget_mb {
        findings.push(Finding::warning(
            BUDGET_KEY,
            format!(
                "the ring would write {} MB a day and may write {}: it stops after {} h of a day",
                significant_digits(day_mb, 2),
                significant_digits(budget_mb, 2),
                significant_digits(24.0 * budget_mb / day_mb, 2)
            ),
            "raise the budget, or put `service.recordings.directory` into memory, as in \
             /dev/shm/didim-recordings, and leave the budget out",
        ));
    }
}

/// Returns what the service writes, for people. `None` without a bus.
pub fn writing_text(cell: &Cell) -> Option<String> {
    let bus = cell.bus().ok()?;
    let results = RESULT_BYTES / 1000;
    let ring = cell.service.recordings.as_ref().map(|_| {
        let day_mb = bytes_per_second(cell, bus) * 86_400.0 / 1e6;
        format!(", frames up to {} MB a day", significant_digits(day_mb, 2))
    });
    let budget = cell.service.write_mb_per_day;
    let budget = budget.map(|megabytes| format!("; at most {megabytes} MB a day"));
    let [ring, budget] = [ring, budget].map(Option::unwrap_or_default);
    Some(format!("writes {results} kB a result{ring}{budget}\n"))
}

/// Finds problems that depend on this machine.
pub(super) fn check_disk(cell: &Cell, findings: &mut Vec<Finding>) {
    let Some(options) = &cell.service.recordings else { return };
    let folder = options.folder(&cell.service.state_directory);
    for part in [folder.clone()].iter().chain(&recording_folders(&folder)) {
        check_owner(DIRECTORY_KEY, part, cell, findings);
    }
    let nearest_folder = existing_parent(&folder);
    let Some(free) = space_left(&nearest_folder) else { return };
    let needed = (options.ring_mb + options.keep_mb).saturating_mul(1_000_000);
    // The recordings of an earlier run count as free space, because they will be replaced.
    if free.saturating_add(used_bytes(&folder)) < needed {
        findings.push(Finding::warning(
            RING_KEY,
            format!(
                "the ring and the kept recordings take up to {} MB, and {} has {} MB left",
                megabytes(needed),
                nearest_folder.display(),
                megabytes(free)
            ),
            "reduce the ring, or put `service.recordings.directory` on a larger disk",
        ));
    }
}

/// Returns the data rate of the layout's frames \[bytes/s\]. Other frames on the bus are recorded
/// as well unless a filter excludes them.
fn bytes_per_second(cell: &Cell, bus: &CellBus) -> f64 {
    let frames = bus.layout.messages().iter();
    let bytes: f64 =
        frames.map(|message| FRAME_BYTES + f64::from(message.format.wire_length())).sum();
    bytes * cell.sample_rate_hz()
}

/// Returns the total size of the files in the two recording folders \[bytes\]. Unreadable files do
/// not count.
fn used_bytes(folder: &std::path::Path) -> u64 {
    let folders = recording_folders(folder).map(std::fs::read_dir);
    let entries = folders.into_iter().flatten().flatten().flatten();
    entries.filter_map(|entry| entry.metadata().ok()).map(|data| data.len()).sum()
}
