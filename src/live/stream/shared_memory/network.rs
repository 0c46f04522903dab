//! Names of the networks in shared memory: a random prefix, and a lock that keeps it.
//!
//! /dev/shm is open to every user. A name that another user can guess can be taken, truncated or
//! filled before the start. The prefix is therefore drawn at random for each network.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Seek as _, Write as _};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::process::geteuid;
use rustix::rand::{GetRandomFlags, getrandom};

use super::prefault::SHARED_MEMORY;
use crate::live::stream::options::{FOLDER_NAME, SERVICE_PREFIX};

/// Prefix of the names in /dev/shm of every network of a single run.
pub const RUN_PREFIX: &str = "didim-run-";
/// Number of random hexadecimal digits after the prefix: 48 bits, which cannot be guessed.
const RANDOM_DIGITS: usize = 12;
/// Suffix of a file in /dev/shm, after the network's prefix. Every process of the network keeps
/// this file locked.
pub(super) const LOCK_SUFFIX: &str = "lock";
/// File in the runtime folder of a service with the prefix of its network.
const PREFIX_FILE: &str = "ipc.prefix";
/// Maximum length of the prefix in that file that is read \[bytes\].
const MAX_PREFIX_TEXT: u64 = 64;
/// Prefix of the folder name of every run.
const FOLDER_PREFIX: &str = "didim-";
/// Number of attempts to lock a file. Another process of the user may hold it for the moment of its
/// own start. Together with the pause, it is a second.
const LOCK_ATTEMPTS: u32 = 100;
const ATTEMPT_PAUSE: Duration = Duration::from_millis(10);
/// Maximum length of a network's folder path in the lock file \[bytes\].
const MAX_PATH: u64 = 4096;

/// Network of a single run of a program, for example of a demonstration. The library's files are
/// removed when this guard is dropped. Create it before the first node, so that it is dropped after
/// the last one.
///
/// A killed run does not remove its shared memory. The kernel releases its lock, and the next run
/// of the same user removes the files. The lock reliably distinguishes dead runs from live ones.
/// Process ids do not: they are reused, and containers that share /dev/shm have separate ids.
#[derive(Debug)]
pub struct PrivateNetwork {
    folder: PathBuf,
    prefix: String,
    _locked: File,
}

impl PrivateNetwork {
    /// Draws the prefix of a network whose other files are in `folder`. No other run may use the
    /// folder. Also removes the files of dead networks of this user.
    ///
    /// # Errors
    /// /dev/shm cannot be written, or the system has no random numbers.
    pub fn new(folder: &Path) -> io::Result<Self> {
        remove_dead();
        let (prefix, locked) = draw(RUN_PREFIX, folder)?;
        Ok(Self { folder: folder.to_owned(), prefix, _locked: locked })
    }

    /// Returns the prefix of the names in /dev/shm.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }
}

impl Drop for PrivateNetwork {
    fn drop(&mut self) {
        remove(&self.folder, &self.prefix);
    }
}

/// Membership of a process in the network of a service. The processes of a service find the prefix
/// in a file of the runtime folder. It is valid while one of them lives. The first process of the
/// next start draws another one.
///
/// Create it before the first node. When it is dropped and no other process of the service lives,
/// the files of the network are removed.
#[derive(Debug)]
pub struct ServiceNetwork {
    root: PathBuf,
    prefix: String,
    locked: File,
}

impl ServiceNetwork {
    /// Joins the network of the service with this runtime folder, or creates it. Only the own user
    /// may be able to write to the folder. Also removes the files of dead networks of this user.
    /// Waits at most a second for another process of the service that is joining.
    ///
    /// # Errors
    /// The system's error, with the path of the file.
    pub fn join(runtime: &Path) -> io::Result<Self> {
        let path = runtime.join(PREFIX_FILE);
        let mut named = open(&path, OpenOptions::new().create(true)).map_err(at(&path))?;
        if !wait_for_lock(&named, FlockOperation::NonBlockingLockExclusive) {
            let why = "is locked by another process of the service, which does not start; end it";
            return Err(at(&path)(io::Error::new(ErrorKind::ResourceBusy, why)));
        }
        remove_dead();
        let root = runtime.join(FOLDER_NAME);
        let mut text = String::new();
        let read = (&mut named).take(MAX_PREFIX_TEXT).read_to_string(&mut text);
        if read.is_ok()
            && text.starts_with(SERVICE_PREFIX)
            && let Some(locked) = lock_live(&text)
        {
            return Ok(Self { root, prefix: text, locked });
        }
        let (prefix, locked) = draw(SERVICE_PREFIX, &root)?;
        let network = Self { root, prefix, locked };
        named.set_len(0).and_then(|()| named.rewind()).map_err(at(&path))?;
        named.write_all(network.prefix.as_bytes()).map_err(at(&path))?;
        Ok(network)
    }

    /// Returns the prefix of the names in /dev/shm.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }
}

impl Drop for ServiceNetwork {
    fn drop(&mut self) {
        // The exclusive lock shows that no other process of the service lives.
        if try_lock(&self.locked, FlockOperation::NonBlockingLockExclusive) {
            remove(&self.root, &self.prefix);
        }
    }
}

/// Adds the path to an error of the system.
fn at(path: &Path) -> impl Fn(io::Error) -> io::Error {
    move |cause| io::Error::new(cause.kind(), format!("{}: {cause}", path.display()))
}

/// Draws a prefix, and creates and locks its file, which contains the path of the network's folder.
/// A search for dead networks may have removed the file before it was locked. The lock is therefore
/// valid only if the locked file still has the name.
fn draw(base: &str, folder: &Path) -> io::Result<(String, File)> {
    for _ in 0..LOCK_ATTEMPTS {
        let mut random = [0; size_of::<u64>()];
        getrandom(&mut random, GetRandomFlags::empty())?;
        let digits = format!("{:016x}", u64::from_ne_bytes(random));
        let prefix = format!("{base}{}_", digits.get(..RANDOM_DIGITS).unwrap_or(&digits));
        let path = path_of_lock(&prefix);
        let mut file = match open(&path, OpenOptions::new().create_new(true)) {
            Err(cause) if cause.kind() == ErrorKind::AlreadyExists => continue,
            opened => opened.map_err(at(&path))?,
        };
        if try_lock(&file, FlockOperation::NonBlockingLockShared) && has_name(&file, &path) {
            file.write_all(folder.as_os_str().as_encoded_bytes()).map_err(at(&path))?;
            return Ok((prefix, file));
        }
    }
    Err(io::Error::new(ErrorKind::ResourceBusy, "no free name in /dev/shm was found"))
}

/// Locks the file of a network of this user, in which another process lives.
fn lock_live(prefix: &str) -> Option<File> {
    let path = path_of_lock(prefix);
    let file = open(&path, &mut OpenOptions::new()).ok().filter(is_ours)?;
    let locked = wait_for_lock(&file, FlockOperation::NonBlockingLockShared);
    (locked && has_name(&file, &path)).then_some(file)
}

fn path_of_lock(prefix: &str) -> PathBuf {
    Path::new(SHARED_MEMORY).join(format!("{prefix}{LOCK_SUFFIX}"))
}

fn open(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let flags = i32::try_from(OFlags::NOFOLLOW.bits() | OFlags::NONBLOCK.bits());
    options.read(true).write(true).mode(0o600);
    options.custom_flags(flags.unwrap_or(0)).open(path)
}

fn try_lock(file: &File, operation: FlockOperation) -> bool {
    flock(file, operation).is_ok()
}

fn wait_for_lock(file: &File, operation: FlockOperation) -> bool {
    (0..LOCK_ATTEMPTS).any(|attempt| {
        if attempt > 0 {
            std::thread::sleep(ATTEMPT_PAUSE);
        }
        try_lock(file, operation)
    })
}

fn is_ours(file: &File) -> bool {
    file.metadata().is_ok_and(|data| data.uid() == geteuid().as_raw())
}

fn has_name(file: &File, path: &Path) -> bool {
    let inode = |data: fs::Metadata| (data.dev(), data.ino());
    let (opened, named) = (file.metadata().map(inode), fs::symlink_metadata(path).map(inode));
    matches!((opened, named), (Ok(opened), Ok(named)) if opened == named)
}

/// Removes the files of killed processes of the same user. Errors are ignored. Only a network whose
/// lock file still exists is tried again at the next call.
fn remove_dead() {
    for name in names() {
        let Some(prefix) = name.strip_suffix(LOCK_SUFFIX) else { continue };
        let path = path_of_lock(prefix);
        let Ok(mut file) = open(&path, &mut OpenOptions::new()) else { continue };
        if !is_ours(&file)
            || !try_lock(&file, FlockOperation::NonBlockingLockExclusive)
            || !has_name(&file, &path)
        {
            continue;
        }
        let mut folder = String::new();
        let read = (&mut file).take(MAX_PATH).read_to_string(&mut folder);
        let folder = Path::new(if read.is_ok() { folder.as_str() } else { "" });
        tracing::info!("removing what a killed process left: {}", folder.display());
        remove(folder, prefix);
    }
}

/// Removes the files of a network, and the folder if it is that of a run. The locked file is
/// removed last.
fn remove(folder: &Path, prefix: &str) {
    // Only the files of one network may be removed.
    if !is_drawn(prefix) {
        return;
    }
    // The file that is locked shows the next start that something is left.
    if fs::read_dir(SHARED_MEMORY).is_err() {
        return;
    }
    let lock = format!("{prefix}{LOCK_SUFFIX}");
    for name in names().filter(|name| name.starts_with(prefix) && *name != lock) {
        let _ = fs::remove_file(Path::new(SHARED_MEMORY).join(name));
    }
    let name = folder.file_name().and_then(|name| name.to_str());
    if name.is_some_and(|name| name.starts_with(FOLDER_PREFIX)) {
        let _ = fs::remove_dir_all(folder);
    } else if name.is_some() {
        remove_named(folder, prefix);
    }
    let _ = fs::remove_file(path_of_lock(prefix));
}

/// Removes the files below `folder` whose names begin with the prefix, and the folders that become
/// empty by that. Returns true if something was removed.
fn remove_named(folder: &Path, prefix: &str) -> bool {
    let mut removed = false;
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder && remove_named(&entry.path(), prefix) {
            removed = true;
            let _ = fs::remove_dir(entry.path());
        } else if !is_folder && entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes())
        {
            removed |= fs::remove_file(entry.path()).is_ok();
        }
    }
    removed
}

/// Returns true for a prefix that [`draw`] returns.
fn is_drawn(prefix: &str) -> bool {
    let random = [SERVICE_PREFIX, RUN_PREFIX].iter().find_map(|base| prefix.strip_prefix(base));
    random.and_then(|random| random.strip_suffix('_')).is_some_and(|digits| {
        digits.len() == RANDOM_DIGITS && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
    })
}

/// Returns the names in /dev/shm that belong to networks.
fn names() -> impl Iterator<Item = String> {
    let files = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let names = files.filter_map(|file| file.file_name().into_string().ok());
    names.filter(|name| name.starts_with(SERVICE_PREFIX) || name.starts_with(RUN_PREFIX))
}
