//! A network for one run of a program, of which nothing stays.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::process::geteuid;

use super::prefault::SHARED_MEMORY;

/// Beginning of the names in /dev/shm of every such network; its own part follows.
pub const RUN_PREFIX: &str = "didim-run-";
/// Behind a network's prefix, the file that its run holds locked.
const LOCK: &str = "lock";
/// Beginning of the name of every run's folder.
const FOLDER_PREFIX: &str = "didim-";
/// How often, and how long apart, a run tries to lock what another may just be looking at.
const ATTEMPTS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(10);
/// The longest path of a run's folder that is read back \[bytes\].
const MAX_PATH: u64 = 4096;

/// Removes at its end what the library leaves of a network with a prefix and a root of its own, in
/// /dev/shm and in the run's folder. For a demonstration or a replay; a service keeps its prefix, and
/// cleans up after itself at its next start.
///
/// A run that is killed leaves all its shared memory. The kernel takes its lock away, and the next run
/// of the same user removes what is left. A lock tells the dead from the living where a process's
/// number does not: numbers are given again, and containers that share /dev/shm have their own.
///
/// Make it before the first node of the network, so that it is dropped after the last.
#[derive(Debug)]
pub struct PrivateNetwork {
    folder: PathBuf,
    prefix: String,
    _locked: File,
}

impl PrivateNetwork {
    /// For the network with this prefix, [`RUN_PREFIX`] and more, whose run has its files in `folder`.
    /// Nobody else may use either, and the prefix must not be the beginning of another's: end it with
    /// a `_`. Removes what dead runs have left.
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
    Path::new(SHARED_MEMORY).join(format!("{prefix}{LOCK}"))
}

fn open(path: &Path, create: bool) -> io::Result<File> {
    let flags = i32::try_from(OFlags::NOFOLLOW.bits() | OFlags::NONBLOCK.bits());
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(create).truncate(false).mode(0o600);
    options.custom_flags(flags.unwrap_or(0)).open(path)
}

/// Makes and locks the file of a run. Who looks for dead runs may lock it for a moment, and may have
/// removed it by then: a lock counts only on the file that has the name.
fn lock_own(path: &Path) -> io::Result<File> {
    for _ in 0..ATTEMPTS {
        let file = open(path, true)?;
        if try_lock(&file) && has_name(&file, path) {
            return Ok(file);
        }
        std::thread::sleep(PAUSE);
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

/// Removes what runs of the own user have left that were killed. What cannot be removed is tried again
/// by the next one.
fn remove_dead() {
    for name in names() {
        let Some(prefix) = name.strip_suffix(LOCK) else { continue };
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

/// Removes the files of a network, last the one that is locked, and the folder of its run.
fn remove(folder: &Path, prefix: &str) {
    // Nothing but a run's own: with nothing in front, every network's files would be.
    if !prefix.starts_with(RUN_PREFIX) || prefix == RUN_PREFIX {
        return;
    }
    let lock = format!("{prefix}{LOCK}");
    for name in names().filter(|name| name.starts_with(prefix) && *name != lock) {
        let _ = fs::remove_file(Path::new(SHARED_MEMORY).join(name));
    }
    let name = folder.file_name().and_then(|name| name.to_str());
    if name.is_some_and(|name| name.starts_with(FOLDER_PREFIX)) {
        let _ = fs::remove_dir_all(folder);
    }
    let _ = fs::remove_file(path_of_lock(prefix));
}

/// The names in /dev/shm that are of such networks.
fn names() -> impl Iterator<Item = String> {
    let files = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let names = files.filter_map(|file| file.file_name().into_string().ok());
    names.filter(|name| name.starts_with(RUN_PREFIX))
}
