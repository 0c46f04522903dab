//! Operations on files of Linux.

use std::fs::{File, Metadata, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::fs::{Mode, OFlags};

use super::FileSystemSpace;

pub(in crate::files) use std::os::unix::fs::symlink as link;

/// A file under any of its names, links included: its device and its number.
pub type FileIdentity = (u64, u64);

/// Returns the identity of an existing file.
pub fn identity(path: &Path) -> Option<FileIdentity> {
    std::fs::metadata(path).ok().map(|data| (data.dev(), data.ino()))
}

/// Returns the number of a file. A file that replaces another one has its own.
pub fn file_number(data: &Metadata) -> u64 {
    data.ino()
}

/// Opens and locks a folder. `None` if another process has locked it.
///
/// The lock belongs to the opened folder (flock(2)). The kernel releases it at every kind of
/// process end.
///
/// # Errors
/// Those of the file system.
pub fn lock_folder(folder: &Path) -> io::Result<Option<File>> {
    let file = File::open(folder)?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(cause)) => Err(cause),
    }
}

/// Returns the space of the file system of a folder.
///
/// # Errors
/// Those of the file system.
pub fn disk_space(folder: &Path) -> io::Result<FileSystemSpace> {
    let space = rustix::fs::statvfs(folder)?;
    Ok(FileSystemSpace {
        size: space.f_frsize * space.f_blocks,
        free: space.f_frsize * space.f_bavail,
    })
}

/// Opens a file for reading. `open` does not block on a pipe.
pub(in crate::files) fn open_regular(path: &Path) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    Ok(File::from(rustix::fs::open(path, flags, Mode::empty())?))
}

/// Syncs the names in a folder to the disk.
pub(in crate::files) fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}
