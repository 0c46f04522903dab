//! Allocation of the pages of mapped shared memory before the first sample needs them.
//!
//! A tmpfs allocates a page when it is first touched. If no page is available, the process is
//! killed with SIGBUS. If all pages are requested at the start, the kernel returns an error
//! instead, and the bus thread never waits for a page.
#![allow(
    unsafe_code,
    reason = "madvise takes an address; no library offers it for a mapping of another"
)]

use std::io::ErrorKind;
use std::path::Path;
use std::time::Duration;

use rustix::mm::{Advice, madvise};

use crate::live::stream::StreamError;

/// Folder of the library's segments.
pub const SHARED_MEMORY: &str = "/dev/shm";

/// Maximum number of times that the mappings are listed again because one of them no longer
/// existed.
const MAX_ATTEMPTS: usize = 20;

/// Pause between two attempts.
const ATTEMPT_PAUSE: Duration = Duration::from_millis(5);

/// Populates every writable mapping of this process whose file in [`SHARED_MEMORY`] begins with
/// `prefix`, and returns their total size \[bytes\]. Kernels before 5.14 do not support this. The
/// function then returns 0, and the pages are allocated when they are first touched.
///
/// The kernel returns ENOMEM in two cases: the range is not mapped, or pages are not available. The
/// first case occurs while another thread lets the library open a segment and close it again. The
/// next such segment may have the same address, so the list of mappings cannot distinguish the
/// cases. A lack of memory persists, whereas a briefly opened segment disappears. The function
/// therefore tries [`MAX_ATTEMPTS`] times.
///
/// # Errors
/// [`StreamError::Prefault`] if the pages are not available.
pub(super) fn populate_mappings(prefix: &str) -> Result<u64, StreamError> {
    let mut attempt = 1;
    loop {
        let mine = mappings(prefix)?;
        let mapped_bytes = mine.iter().map(|(_, length)| *length as u64).sum();
        match mine.into_iter().try_for_each(populate_range) {
            Ok(()) => return Ok(mapped_bytes),
            Err(cause) if cause.kind() == ErrorKind::InvalidInput => {
                tracing::warn!("this kernel cannot populate shared memory in advance");
                return Ok(0);
            }
            Err(cause) if cause.kind() == ErrorKind::OutOfMemory && attempt < MAX_ATTEMPTS => {
                attempt += 1;
                std::thread::sleep(ATTEMPT_PAUSE);
            }
            Err(cause) => {
                return Err(StreamError::Prefault { folder: SHARED_MEMORY, mapped_bytes, cause });
            }
        }
    }
}

fn populate_range((start, length): (usize, usize)) -> std::io::Result<()> {
    let address = core::ptr::with_exposed_provenance_mut(start);
    // SAFETY: MADV_POPULATE_WRITE changes no byte of memory. It only makes the kernel allocate the
    // pages of the range, as a write would. A range that is no longer mapped gives ENOMEM. The call
    // therefore affects no reference into these mappings, whether of this crate or of the library.
    unsafe { madvise(address, length, Advice::LinuxPopulateWrite) }.map_err(Into::into)
}

/// Returns the start and the length of every writable mapping of this process whose file begins
/// with `prefix`.
fn mappings(prefix: &str) -> Result<Vec<(usize, usize)>, StreamError> {
    let path = Path::new("/proc/self/maps");
    let maps = std::fs::read_to_string(path)
        .map_err(|cause| StreamError::Inspect { path: path.into(), cause })?;
    Ok(maps.lines().filter_map(|line| mapping(line, prefix)).collect())
}

/// Parses the start and the length from a line of /proc/PID/maps. `None` unless it is a writable
/// mapping whose file begins with `prefix`. Example: `7f00a000-7f00b000 rw-s 00000000 00:1a 42
/// /dev/shm/prefix…`.
fn mapping(line: &str, prefix: &str) -> Option<(usize, usize)> {
    let mut fields = line.split_ascii_whitespace();
    let (start, end) = fields.next()?.split_once('-')?;
    let rights = fields.next()?;
    let file = fields.nth(3)?.strip_prefix(SHARED_MEMORY)?.strip_prefix('/')?;
    if !rights.starts_with("rw") || !file.starts_with(prefix) {
        return None;
    }
    let start = usize::from_str_radix(start, 16).ok()?;
    let end = usize::from_str_radix(end, 16).ok()?;
    Some((start, end.checked_sub(start)?))
}

/// Checks that the tmpfs at `folder` has at least `needed_bytes` free.
///
/// # Errors
/// [`StreamError::SharedMemoryFull`] with both figures.
pub(super) fn check_free(folder: &Path, needed_bytes: u64) -> Result<(), StreamError> {
    let inspect = |cause: rustix::io::Errno| StreamError::Inspect {
        path: folder.into(),
        cause: cause.into(),
    };
    let space = rustix::fs::statvfs(folder).map_err(inspect)?;
    let available_bytes = space.f_bavail.saturating_mul(space.f_frsize);
    if available_bytes < needed_bytes {
        return Err(StreamError::SharedMemoryFull {
            folder: folder.into(),
            needed_bytes,
            available_bytes,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_writable_mappings_of_the_prefix_are_taken() {
        let ours =
            "7f00a000-7f00c000 rw-s 00000000 00:1a 42                  /dev/shm/didim_ab.data";
        assert_eq!(mapping(ours, "didim_"), Some((0x7f00_a000, 0x2000)));
        assert_eq!(mapping(ours, "other_"), None);
        assert_eq!(mapping(&ours.replace("rw-s", "r--s"), "didim_"), None);
        assert_eq!(mapping("7f00a000-7f00c000 rw-p 00000000 00:00 0", "didim_"), None);
        assert_eq!(mapping("nonsense", "didim_"), None);
    }

    #[test]
    fn a_refusal_says_what_is_needed_and_what_is_there() {
        let refusal = check_free(Path::new(SHARED_MEMORY), u64::MAX).unwrap_err();
        let StreamError::SharedMemoryFull { needed_bytes, available_bytes, .. } = &refusal else {
            panic!("{refusal:?}");
        };
        let text = refusal.to_string();
        assert!(text.contains(&needed_bytes.to_string()));
        assert!(text.contains(&available_bytes.to_string()));
        check_free(Path::new(SHARED_MEMORY), 1).unwrap();
    }
}
