//! A network for a single run of a program, removed completely afterwards.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::process::geteuid;

use super::prefault::SHARED_MEMORY;

/// Prefix of the names in /dev/shm of every such network. Each network appends its own part.
pub const RUN_PREFIX: &str = "didim-run-";
/// Suffix of a file in /dev/shm, after the network's prefix. The run keeps this file locked.
const LOCK_SUFFIX: &str = "lock";
/// Prefix of the folder name of every run.
const FOLDER_PREFIX: &str = "didim-";
/// Number of attempts to lock a file, which another run may hold while it searches for dead runs.
const LOCK_ATTEMPTS: u32 = 100;
const ATTEMPT_PAUSE: Duration = Duration::from_millis(10);
/// Maximum length of a run's folder path in the lock file \[bytes\].
const MAX_PATH: u64 = 4096;

/// Guard that removes the library's files of a network when it is dropped. The network has its own
/// prefix in /dev/shm and its own root in the run's folder. It is meant for a demonstration or a
/// replay. A service keeps its prefix, and cleans up at its next start.
///
/// A killed run does not remove its shared memory. The kernel releases its lock, and the next run
/// of the same user removes the files. The lock reliably distinguishes dead runs from live ones.
/// Process ids do not: they are reused, and containers that share /dev/shm have separate ids.
///
/// Create the guard before the first node of the network, so that it is dropped after the last one.
#[derive(Debug)]
pub struct PrivateNetwork {
    folder: PathBuf,
    prefix: String,
    _locked: File,
}

impl PrivateNetwork {
    /// Creates the guard for the network with this prefix, which must begin with [`RUN_PREFIX`] and
    /// have a further part. The files of the run are in `folder`. No other run may use the folder
    /// or the prefix. The prefix must not be the beginning of another one, so end it with `_`. Also
    /// removes the files of dead runs.
    ///
    /// # Errors
    /// The prefix is in use, or /dev/shm cannot be written.
    pub fn new(folder: &Path, prefix: &str) -> io::Result<Self> {
        remove_dead();
        let mut locked = lock_own(&path_of_lock(prefix))?;
        locked.set_len(0)?;
        locked.write_all(folder.as_os_str().as_encoded_bytes())?;
        Ok(Self { folder: folder.to_owned(), prefix: prefix.to_owned(), _locked: locked })
    }
}

impl Drop for PrivateNetwork {
    fn drop(&mut self) {
        remove(&self.folder, &self.prefix);
    }
}

fn path_of_lock(prefix: &str) -> PathBuf {
    Path::new(SHARED_MEMORY).join(format!("{prefix}{LOCK_SUFFIX}"))
}

fn open(path: &Path, create: bool) -> io::Result<File> {
    let flags = i32::try_from(OFlags::NOFOLLOW.bits() | OFlags::NONBLOCK.bits());
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(create).truncate(false).mode(0o600);
    options.custom_flags(flags.unwrap_or(0)).open(path)
}

/// Creates and locks the file of a run. A search for dead runs may lock the file briefly, or may
/// have removed it. The lock is therefore valid only if the locked file still has the name.
fn lock_own(path: &Path) -> io::Result<File> {
    for _ in 0..LOCK_ATTEMPTS {
        let file = open(path, true)?;
        if try_lock(&file) && has_name(&file, path) {
            return Ok(file);
        }
        std::thread::sleep(ATTEMPT_PAUSE);
    }
    let why = format!("{} is in use by another process", path.display());
    Err(io::Error::new(io::ErrorKind::ResourceBusy, why))
}

fn try_lock(file: &File) -> bool {
    flock(file, FlockOperation::NonBlockingLockExclusive).is_ok()
}

fn has_name(file: &File, path: &Path) -> bool {
    let inode = |data: fs::Metadata| (data.dev(), data.ino());
    let (opened, named) = (file.metadata().map(inode), fs::symlink_metadata(path).map(inode));
    matches!((opened, named), (Ok(opened), Ok(named)) if opened == named)
}

/// Removes the files of killed runs of the same user. Errors are ignored. Only a run whose lock
/// file still exists is tried again at the next call.
fn remove_dead() {
    for name in names() {
        let Some(prefix) = name.strip_suffix(LOCK_SUFFIX) else { continue };
        let path = path_of_lock(prefix);
        let Ok(mut file) = open(&path, false) else { continue };
        let is_ours = file.metadata().is_ok_and(|data| data.uid() == geteuid().as_raw());
        if !is_ours || !try_lock(&file) || !has_name(&file, &path) {
            continue;
        }
        let mut folder = String::new();
        let read = (&mut file).take(MAX_PATH).read_to_string(&mut folder);
        let folder = Path::new(if read.is_ok() { folder.as_str() } else { "" });
        tracing::info!("removing what a killed run left: {}", folder.display());
        remove(folder, prefix);
    }
}

/// Removes the files of a network and the folder of its run. The locked file is removed last.
fn remove(folder: &Path, prefix: &str) {
    // Only the files of one run may be removed. An empty suffix would match the files of every
    // network.
    if !prefix.starts_with(RUN_PREFIX) || prefix == RUN_PREFIX {
        return;
    }
    let lock = format!("{prefix}{LOCK_SUFFIX}");
    for name in names().filter(|name| name.starts_with(prefix) && *name != lock) {
        let _ = fs::remove_file(Path::new(SHARED_MEMORY).join(name));
    }
    let name = folder.file_name().and_then(|name| name.to_str());
    if name.is_some_and(|name| name.starts_with(FOLDER_PREFIX)) {
        let _ = fs::remove_dir_all(folder);
    }
    let _ = fs::remove_file(path_of_lock(prefix));
}

/// Returns the names in /dev/shm that belong to networks of single runs.
fn names() -> impl Iterator<Item = String> {
    let files = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let names = files.filter_map(|file| file.file_name().into_string().ok());
    names.filter(|name| name.starts_with(RUN_PREFIX))
}
