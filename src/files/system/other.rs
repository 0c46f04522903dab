//! Operations on files of systems without the service, by the standard library alone.

use std::fs::{File, Metadata, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::FileSystemSpace;

/// A file under any of its names, links included: its path without links.
pub type FileIdentity = PathBuf;

/// Name of the file that locks its folder.
const LOCK_FILE: &str = ".lock";

/// Returns the identity of an existing file.
pub fn identity(path: &Path) -> Option<FileIdentity> {
    std::fs::canonicalize(path).ok()
}

/// Returns 0: the standard library has no number of a file for every system.
pub fn file_number(_: &Metadata) -> u64 {
    0
}

/// Locks a folder by a file in it. `None` if another process has locked it.
///
/// # Errors
/// Those of the file system.
pub fn lock_folder(folder: &Path) -> io::Result<Option<File>> {
    let file = File::create(folder.join(LOCK_FILE))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(cause)) => Err(cause),
    }
}

/// Returns an error: only the service asks for the space of a disk.
///
/// # Errors
/// [`io::ErrorKind::Unsupported`].
pub fn disk_space(_: &Path) -> io::Result<FileSystemSpace> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Copies a file of the same folder in place of a link to it.
pub(in crate::files) fn link(target: &str, path: &Path) -> io::Result<()> {
    std::fs::copy(path.with_file_name(target), path).map(drop)
}

/// Opens a file for reading.
pub(in crate::files) fn open_regular(path: &Path) -> io::Result<File> {
    File::open(path)
}

/// Does nothing: a folder cannot be opened on every system.
pub(in crate::files) fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}
