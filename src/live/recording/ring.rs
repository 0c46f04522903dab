//! The files of the ring: their names, their number, their size.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use didim_drivers::source::mcap::{McapError, McapScan, RepairError, repair};
use rustix::fs::{FlockOperation, flock, statvfs};

/// A file of the ring.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Its number: later files have greater ones.
    pub number: u64,
    /// Where it is.
    pub path: PathBuf,
    /// Its size \[bytes\].
    pub bytes: u64,
    /// The `log_time` of its first frame \[ns\]; nothing when that is not known.
    pub first_log_time: Option<u64>,
}

/// Why the ring cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RingError {
    /// The file system refused. Check the permissions of the folder and the space left.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// Another process records there: end it, or name another folder.
    #[error("{} is in use by another process; end it, or choose another folder", folder.display())]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// A file that has no end cannot be closed.
    #[error("a file of an earlier run cannot be closed: {0}")]
    Repair(#[from] RepairError),
}

impl RingError {
    /// Whether there was no room.
    pub fn is_full(&self) -> bool {
        use io::ErrorKind::{QuotaExceeded, StorageFull};
        match self {
            Self::Io { cause, .. } => matches!(cause.kind(), StorageFull | QuotaExceeded),
            Self::Repair(RepairError::Write { source, .. }) => source.is_full(),
            Self::Repair(_) | Self::InUse { .. } => false,
        }
    }
}

/// Ends of names: of a file that is whole, of the one being written, and of one being repaired.
const WHOLE: &str = ".mcap";
const PART: &str = ".mcap.part";
const TEMPORARY: &str = ".repairing.tmp";

/// What the ring leaves free on its file system for results, which are worth more: a sixteenth, and
/// no more than this \[bytes\]: some 150 results with their reports.
const RESERVED_PART: u64 = 16;
const RESERVED_BYTES: u64 = 32_000_000;

/// A folder of files, of which the oldest go so that all of them stay below the limit. Locked as long
/// as this lives. Files with other names are left alone.
#[derive(Debug)]
pub struct Ring {
    folder: PathBuf,
    _locked: File,
    limit: u64,
    whole: VecDeque<Segment>,
    next: u64,
    repaired: u64,
    /// The file whose first frame was last looked for.
    scanned: Option<u64>,
}

impl Ring {
    /// Opens the folder, making it if need be: closes what has no end, and keeps the limit \[bytes\].
    ///
    /// # Errors
    /// [`RingError`].
    pub fn open(folder: &Path, limit: u64) -> Result<Self, RingError> {
        fs::create_dir_all(folder).map_err(at("make the folder", folder))?;
        let locked = File::open(folder).map_err(at("open the folder", folder))?;
        flock(&locked, FlockOperation::NonBlockingLockExclusive).map_err(|error| match error {
            rustix::io::Errno::WOULDBLOCK => RingError::InUse { folder: folder.to_owned() },
            other => at("lock the folder", folder)(other.into()),
        })?;
        remove_if_there(&folder.join(TEMPORARY))?;
        let files = segments(folder).map_err(at("read the folder", folder))?;
        let next = files.last().map_or(0, |last| last.number.saturating_add(1));
        let (parts, whole): (Vec<_>, Vec<_>) = files.into_iter().partition(Segment::is_part);
        for repaired in &whole {
            remove_if_there(&folder.join(name(repaired.number, PART)))?;
        }
        let mut ring = Self {
            folder: folder.to_owned(),
            _locked: locked,
            limit,
            whole: whole.into(),
            next,
            repaired: 0,
            scanned: None,
        };
        let mut parts: VecDeque<Segment> = parts.into();
        while let Some(part) = parts.pop_front() {
            // While it is repaired it is there twice.
            let waiting: u64 = parts.iter().map(|part| part.bytes).sum();
            let needed = part.bytes.saturating_mul(2).saturating_add(waiting);
            let mut fits = ring.make_room(needed)?;
            while fits {
                match ring.close(&part) {
                    Ok(()) => break,
                    // Older files give way to it, and at last it gives way itself.
                    Err(error) if error.is_full() => {
                        let before = room(folder)?.left;
                        fits = ring.remove_oldest()?;
                        // What one left may be free only later: not all of them for nothing.
                        if fits && room(folder)?.left <= before {
                            return Err(error);
                        }
                    }
                    Err(error) => return Err(error),
                }
            }
            if !fits {
                // Larger than the whole ring may be, or than the disk has room for.
                remove_if_there(&part.path)?;
            }
        }
        ring.make_room(0)?;
        Ok(ring)
    }

    /// Repairs what a recorder left that was killed.
    fn close(&mut self, part: &Segment) -> Result<(), RingError> {
        let temporary = self.folder.join(TEMPORARY);
        let repaired = repair(&part.path, &temporary);
        let is_empty = match &repaired {
            Ok(repair) => repair.frames == 0,
            // It was killed before the first chunk was on disk, or it is not ours.
            Err(RepairError::Foreign { .. } | RepairError::Read(McapError::NotMcap { .. })) => true,
            // The power failed: what is damaged comes before every frame, and will not get better.
            Err(RepairError::Read(error @ McapError::Damaged { .. })) => {
                tracing::warn!("a damaged file is removed: {error}");
                true
            }
            Err(RepairError::Read(_) | RepairError::Write { .. }) => false,
        };
        if is_empty {
            remove_if_there(&temporary)?;
            return fs::remove_file(&part.path).map_err(at("remove", &part.path));
        }
        if let Err(error) = repaired {
            remove_if_there(&temporary)?;
            return Err(error.into());
        }
        let path = self.folder.join(name(part.number, WHOLE));
        fs::rename(&temporary, &path).map_err(at("rename to", &path))?;
        fs::remove_file(&part.path).map_err(at("remove", &part.path))?;
        self.repaired += 1;
        self.whole.push_back(segment(part.number, path)?);
        self.whole.make_contiguous().sort_by_key(|segment| segment.number);
        Ok(())
    }

    /// Removes the oldest file; false when there is none.
    ///
    /// # Errors
    /// [`RingError::Io`].
    pub fn remove_oldest(&mut self) -> Result<bool, RingError> {
        let Some(oldest) = self.whole.front() else { return Ok(false) };
        remove_if_there(&oldest.path)?;
        self.whole.pop_front();
        Ok(true)
    }

    /// Removes the oldest files until `bytes` more fit; false when not even an empty ring has room.
    ///
    /// # Errors
    /// [`RingError::Io`].
    pub fn make_room(&mut self, bytes: u64) -> Result<bool, RingError> {
        while self.bytes().saturating_add(bytes) > self.limit {
            if !self.remove_oldest()? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The path of the next file.
    pub fn next_path(&self) -> PathBuf {
        self.folder.join(name(self.next, PART))
    }

    /// The file at [`Self::next_path`] is whole.
    ///
    /// # Errors
    /// [`RingError::Io`].
    pub fn add(&mut self, first_log_time: Option<u64>) -> Result<(), RingError> {
        let (part, path) = (self.next_path(), self.folder.join(name(self.next, WHOLE)));
        fs::rename(&part, &path).map_err(at("rename to", &path))?;
        self.whole.push_back(Segment { first_log_time, ..segment(self.next, path)? });
        self.next = self.next.saturating_add(1);
        Ok(())
    }

    /// Size of the whole files \[bytes\].
    pub fn bytes(&self) -> u64 {
        self.whole.iter().map(|segment| segment.bytes).sum()
    }

    /// The bound \[bytes\].
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// The whole files, oldest first.
    pub fn whole(&self) -> impl ExactSizeIterator<Item = &Segment> {
        self.whole.iter()
    }

    /// The `log_time` of the oldest frame \[ns\]. A file that cannot be read is not read again.
    pub fn oldest_log_time(&mut self) -> Option<u64> {
        let oldest = self.whole.front_mut()?;
        if oldest.first_log_time.is_none() && self.scanned != Some(oldest.number) {
            self.scanned = Some(oldest.number);
            oldest.first_log_time = first_log_time(&oldest.path);
        }
        oldest.first_log_time
    }

    /// Files that had no end when it was opened, and have one now.
    pub fn repaired(&self) -> u64 {
        self.repaired
    }
}

impl Segment {
    /// Whether it is being written, or was when its writer was killed.
    pub fn is_part(&self) -> bool {
        self.path.as_os_str().as_encoded_bytes().ends_with(PART.as_bytes())
    }
}

/// The files of a ring, oldest first, the one being written included.
pub(super) fn segments(folder: &Path) -> io::Result<Vec<Segment>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let Some(number) = entry.file_name().to_str().and_then(number) else { continue };
        // One that goes meanwhile is not there.
        if let Ok(metadata) = entry.metadata() {
            let (path, bytes) = (entry.path(), metadata.len());
            found.push(Segment { number, path, bytes, first_log_time: None });
        }
    }
    found.sort_by(|a, b| (a.number, &a.path).cmp(&(b.number, &b.path)));
    // While one is renamed or repaired it may be there twice: whole, and then what it was before.
    found.dedup_by_key(|segment| segment.number);
    Ok(found)
}

/// Room on a file system \[bytes\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// All that is free.
    pub(super) left: u64,
    /// What is free beside what is left to results.
    pub(super) spare: u64,
}

/// The room on the file system of a folder.
pub(super) fn room(folder: &Path) -> Result<Room, RingError> {
    let space = statvfs(folder).map_err(|cause| at("look at the disk of", folder)(cause.into()))?;
    let (all, left) = (space.f_frsize * space.f_blocks, space.f_frsize * space.f_bavail);
    let spare = left.saturating_sub((all / RESERVED_PART).min(RESERVED_BYTES));
    Ok(Room { left, spare })
}

fn segment(number: u64, path: PathBuf) -> Result<Segment, RingError> {
    let bytes = fs::metadata(&path).map_err(at("look at", &path))?.len();
    Ok(Segment { number, path, bytes, first_log_time: None })
}

fn first_log_time(path: &Path) -> Option<u64> {
    McapScan::of(path).ok()?.chunks.first().map(|chunk| chunk.first_log_time)
}

fn name(number: u64, end: &str) -> String {
    format!("segment-{number:08}{end}")
}

/// The number in a name of ours.
fn number(found: &str) -> Option<u64> {
    let digits = found.strip_prefix("segment-")?.split('.').next()?;
    let number = digits.parse().ok()?;
    [WHOLE, PART].iter().any(|end| name(number, end) == found).then_some(number)
}

fn remove_if_there(path: &Path) -> Result<(), RingError> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(at("remove", path)(cause)),
        _ => Ok(()),
    }
}

pub(super) fn at(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RingError {
    let path = path.to_owned();
    move |cause| RingError::Io { action, path, cause }
}
