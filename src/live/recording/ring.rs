//! The files of the ring: their names, number and size.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use didim_drivers::source::mcap::{McapError, McapScan, RepairError, repair_recording};

use crate::files::{self, lock_folder};

/// A file of the ring.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Number of the file. Later files have greater numbers.
    pub number: u64,
    /// Path of the file.
    pub path: PathBuf,
    /// Size of the file \[bytes\].
    pub bytes: u64,
    /// `log_time` of its first frame \[ns\]. `None` if unknown.
    pub first_log_time: Option<u64>,
}

/// Error when using the ring.
#[derive(Debug, thiserror::Error)]
pub enum RingError {
    /// The file system refused the operation. Check the permissions of the folder and the free
    /// space.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// The attempted operation.
        action: &'static str,
        /// Path that the operation used.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// Another process records to this folder. Stop it, or name another folder.
    #[error("{} is in use by another process; end it, or choose another folder", folder.display())]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// A file that was not closed cannot be repaired.
    #[error("a file of an earlier run cannot be closed: {0}")]
    Repair(#[from] RepairError),
}

impl RingError {
    /// Returns true if the disk was full.
    pub fn is_full(&self) -> bool {
        use io::ErrorKind::{QuotaExceeded, StorageFull};
        match self {
            Self::Io { cause, .. } => matches!(cause.kind(), StorageFull | QuotaExceeded),
            Self::Repair(RepairError::Write { source, .. }) => source.is_full(),
            Self::Repair(_) | Self::InUse { .. } => false,
        }
    }
}

/// File name suffixes of a complete file, of the file being written, and of a file being repaired.
const COMPLETE_SUFFIX: &str = ".mcap";
const PART_SUFFIX: &str = ".mcap.part";
const TEMPORARY_SUFFIX: &str = ".repairing.tmp";

/// The ring leaves space on its file system free for results, which have priority:
/// 1/`RESERVED_PART` of the file system, but at most `RESERVED_BYTES` \[bytes\], the size of some
/// 150 results with their reports.
const RESERVED_PART: u64 = 16;
const RESERVED_BYTES: u64 = 32_000_000;

/// A folder of ring files. The oldest files are removed so that the total size stays below the
/// limit. The folder is locked while this value exists. Files with other names are not changed.
#[derive(Debug)]
pub struct Ring {
    folder: PathBuf,
    _locked: File,
    limit: u64,
    complete_segments: VecDeque<Segment>,
    next_number: u64,
    repaired_segments: u64,
    /// Number of the last file that was read to find its first frame.
    last_scanned_file: Option<u64>,
}

impl Ring {
    /// Opens the folder, and creates it if necessary. Repairs files that were not closed, and
    /// enforces the size limit \[bytes\].
    ///
    /// # Errors
    /// [`RingError`].
    pub fn open(folder: &Path, limit: u64) -> Result<Self, RingError> {
        fs::create_dir_all(folder).map_err(io_error("make the folder", folder))?;
        let locked = lock_folder(folder)
            .map_err(io_error("lock the folder", folder))?
            .ok_or_else(|| RingError::InUse { folder: folder.to_owned() })?;
        remove_if_there(&folder.join(TEMPORARY_SUFFIX))?;
        let files = segments(folder).map_err(io_error("read the folder", folder))?;
        let next = files.last().map_or(0, |last| last.number.saturating_add(1));
        let (parts, complete): (Vec<_>, Vec<_>) = files.into_iter().partition(Segment::is_part);
        for repaired in &complete {
            remove_if_there(&folder.join(name(repaired.number, PART_SUFFIX)))?;
        }
        let mut ring = Self {
            folder: folder.to_owned(),
            _locked: locked,
            limit,
            complete_segments: complete.into(),
            next_number: next,
            repaired_segments: 0,
            last_scanned_file: None,
        };
        let mut parts: VecDeque<Segment> = parts.into();
        while let Some(part) = parts.pop_front() {
            // During the repair, the file exists twice.
            let waiting: u64 = parts.iter().map(|part| part.bytes).sum();
            let needed = part.bytes.saturating_mul(2).saturating_add(waiting);
            let mut fits = ring.make_room(needed)?;
            while fits {
                match ring.close(&part) {
                    Ok(()) => break,
                    // Older files are removed to make space for the repair. If this is not
                    // sufficient, the file itself is removed.
                    Err(error) if error.is_full() => {
                        let before = disk_space(folder)?.free_bytes;
                        fits = ring.remove_oldest()?;
                        // The file system may free the space of a removed file with a delay. Do not
                        // remove further files without an effect.
                        if fits && disk_space(folder)?.free_bytes <= before {
                            return Err(error);
                        }
                    }
                    Err(error) => return Err(error),
                }
            }
            if !fits {
                // The file is larger than the limit of the ring, or than the free space of the
                // disk.
                remove_if_there(&part.path)?;
            }
        }
        ring.make_room(0)?;
        Ok(ring)
    }

    /// Repairs the unfinished file of a killed recorder.
    fn close(&mut self, part: &Segment) -> Result<(), RingError> {
        let temporary = self.folder.join(TEMPORARY_SUFFIX);
        let repaired = repair_recording(&part.path, &temporary);
        let is_empty = match &repaired {
            Ok(repair) => repair.frames == 0,
            // The recorder was killed before the first chunk was on disk, or the file was not
            // written by a recorder.
            Err(RepairError::Foreign { .. } | RepairError::Read(McapError::NotMcap { .. })) => true,
            // A power failure has damaged the file before its first frame. The damage is permanent.
            Err(RepairError::Read(error @ McapError::Damaged { .. })) => {
                tracing::warn!("a damaged file is removed: {error}");
                true
            }
            Err(RepairError::Read(_) | RepairError::Write { .. }) => false,
        };
        if is_empty {
            remove_if_there(&temporary)?;
            return fs::remove_file(&part.path).map_err(io_error("remove", &part.path));
        }
        if let Err(error) = repaired {
            remove_if_there(&temporary)?;
            return Err(error.into());
        }
        let path = self.folder.join(name(part.number, COMPLETE_SUFFIX));
        fs::rename(&temporary, &path).map_err(io_error("rename to", &path))?;
        fs::remove_file(&part.path).map_err(io_error("remove", &part.path))?;
        self.repaired_segments += 1;
        self.complete_segments.push_back(segment_of_file(part.number, path)?);
        self.complete_segments.make_contiguous().sort_by_key(|segment| segment.number);
        Ok(())
    }

    /// Removes the oldest file. Returns false if there is no file.
    ///
    /// # Errors
    /// [`RingError::Io`].
    pub fn remove_oldest(&mut self) -> Result<bool, RingError> {
        let Some(oldest) = self.complete_segments.front() else { return Ok(false) };
        remove_if_there(&oldest.path)?;
        self.complete_segments.pop_front();
        Ok(true)
    }

    /// Removes the oldest files until `bytes` more fit. Returns false if they would not even fit
    /// into an empty ring.
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

    /// Returns the path of the next file.
    pub fn next_path(&self) -> PathBuf {
        self.folder.join(name(self.next_number, PART_SUFFIX))
    }

    /// Adds the file at [`Self::next_path`], which is complete now.
    ///
    /// # Errors
    /// [`RingError::Io`].
    pub fn add(&mut self, first_log_time: Option<u64>) -> Result<(), RingError> {
        let (part, path) =
            (self.next_path(), self.folder.join(name(self.next_number, COMPLETE_SUFFIX)));
        fs::rename(&part, &path).map_err(io_error("rename to", &path))?;
        self.complete_segments
            .push_back(Segment { first_log_time, ..segment_of_file(self.next_number, path)? });
        self.next_number = self.next_number.saturating_add(1);
        Ok(())
    }

    /// Returns the total size of the complete files \[bytes\].
    pub fn bytes(&self) -> u64 {
        self.complete_segments.iter().map(|segment| segment.bytes).sum()
    }

    /// Returns the maximum size \[bytes\].
    pub fn byte_limit(&self) -> u64 {
        self.limit
    }

    /// Returns the complete files, oldest first.
    pub fn complete_files(&self) -> impl ExactSizeIterator<Item = &Segment> {
        self.complete_segments.iter()
    }

    /// Returns the `log_time` of the oldest frame \[ns\]. A file that was unreadable is not read
    /// again.
    pub fn oldest_log_time(&mut self) -> Option<u64> {
        let oldest = self.complete_segments.front_mut()?;
        if oldest.first_log_time.is_none() && self.last_scanned_file != Some(oldest.number) {
            self.last_scanned_file = Some(oldest.number);
            oldest.first_log_time = first_log_time(&oldest.path);
        }
        oldest.first_log_time
    }

    /// Returns the number of files that were repaired when the ring was opened.
    pub fn repaired_count(&self) -> u64 {
        self.repaired_segments
    }
}

impl Segment {
    /// Returns true if the file is being written, or was being written when its recorder was
    /// killed.
    pub fn is_part(&self) -> bool {
        self.path.as_os_str().as_encoded_bytes().ends_with(PART_SUFFIX.as_bytes())
    }
}

/// Returns the files of a ring, oldest first, including the one being written.
pub(super) fn segments(folder: &Path) -> io::Result<Vec<Segment>> {
    let mut segments = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let Some(number) = entry.file_name().to_str().and_then(parse_number) else { continue };
        // A file that is removed in the meantime is left out.
        if let Ok(metadata) = entry.metadata() {
            let (path, bytes) = (entry.path(), metadata.len());
            segments.push(Segment { number, path, bytes, first_log_time: None });
        }
    }
    segments.sort_by(|a, b| (a.number, &a.path).cmp(&(b.number, &b.path)));
    // During a rename or a repair, a file may exist twice: complete, and in its previous form. The
    // complete one comes first and is used.
    segments.dedup_by_key(|segment| segment.number);
    Ok(segments)
}

/// Free space on a file system \[bytes\].
#[derive(Clone, Copy, Debug)]
pub(super) struct DiskSpace {
    /// Total free space.
    pub(super) free_bytes: u64,
    /// Free space after the reserve for results.
    pub(super) spare_bytes: u64,
}

/// Returns the free space on the file system of a folder.
pub(super) fn disk_space(folder: &Path) -> Result<DiskSpace, RingError> {
    let space = files::disk_space(folder).map_err(io_error("look at the disk of", folder))?;
    let spare = space.free.saturating_sub((space.size / RESERVED_PART).min(RESERVED_BYTES));
    Ok(DiskSpace { free_bytes: space.free, spare_bytes: spare })
}

/// Describes a file of the ring. Does not determine the log time of its first frame.
fn segment_of_file(number: u64, path: PathBuf) -> Result<Segment, RingError> {
    let bytes = fs::metadata(&path).map_err(io_error("look at", &path))?.len();
    Ok(Segment { number, path, bytes, first_log_time: None })
}

fn first_log_time(path: &Path) -> Option<u64> {
    McapScan::read(path).ok()?.chunks.first().map(|chunk| chunk.first_log_time)
}

fn name(number: u64, end: &str) -> String {
    format!("segment-{number:08}{end}")
}

/// Parses the number in a ring file name.
fn parse_number(found: &str) -> Option<u64> {
    let digits = found.strip_prefix("segment-")?.split('.').next()?;
    let number = digits.parse().ok()?;
    [COMPLETE_SUFFIX, PART_SUFFIX].iter().any(|end| name(number, end) == found).then_some(number)
}

fn remove_if_there(path: &Path) -> Result<(), RingError> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
            Err(io_error("remove", path)(cause))
        }
        _ => Ok(()),
    }
}

pub(super) fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RingError {
    let path = path.to_owned();
    move |cause| RingError::Io { action, path, cause }
}
