//! The files of a network in /dev/shm, before the library opens them.
//!
//! The library makes one file that every user may write: the counter of its nodes. A user who
//! truncates it lets every later node poll without end. The file is therefore created here, for the
//! own user alone. The library opens it as it is.

use std::fs::{self, Metadata, Permissions};
use std::io::{self, ErrorKind, Write as _};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::process::geteuid;

use super::network::LOCK_SUFFIX;
use crate::live::stream::StreamError;

/// Name of the library's counter of nodes after the prefix, for its version 0.10.0. The digits are
/// the SHA-1 of the name of its type. A test notices another name: the library would then make a
/// file that others may write.
const COUNTER_NAME: &str = "9204dd183d1c4d8e1ff592a30766ffa6765aa8b5_node.0_10_0.global_mgmt";
/// Content of that file: the version of the library, then the number of nodes, which is zero.
const COUNTER: [u8; 16] = [0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
/// Permissions of every file of a network.
const OWN: u32 = 0o600;
/// Time that another process of the service has to finish a file \[s\]. It takes microseconds.
const UNFINISHED_TIMEOUT: Duration = Duration::from_secs(2);
const POLL: Duration = Duration::from_millis(10);

/// Creates the counter of the nodes if it does not exist. Before that, removes files of this user
/// that nobody finishes: the rest of a process that was killed while it created them, or files that
/// were truncated. Files of other users with the prefix are named in the log, and do no harm: no
/// name that the library opens is free for them.
///
/// # Errors
/// [`StreamError::Inspect`]; [`StreamError::Foreign`] if the counter is another user's, or open to
/// others.
pub(super) fn prepare(folder: &Path, prefix: &str) -> Result<(), StreamError> {
    let inspect = |cause| StreamError::Inspect { path: folder.to_owned(), cause };
    let counter = folder.join(format!("{prefix}{COUNTER_NAME}"));
    if let Ok(data) = counter.symlink_metadata()
        && let Some(problem) = foreign(&data)
    {
        return Err(StreamError::Foreign { path: counter, owner: data.uid(), problem });
    }
    let begin = Instant::now();
    while let Some(path) = find_unfinished(folder, prefix).map_err(inspect)? {
        if begin.elapsed() < UNFINISHED_TIMEOUT {
            std::thread::sleep(POLL);
            continue;
        }
        let owner = geteuid().as_raw();
        tracing::warn!("{} of user {owner} is damaged, and is removed", path.display());
        fs::remove_file(&path).map_err(|cause| StreamError::Inspect { path, cause })?;
    }
    name_strangers(folder, prefix).map_err(inspect)?;
    create_counter(&counter, folder, prefix).map_err(inspect)
}

/// Creates the counter under another name first, so that no other thread finds it unfinished.
fn create_counter(path: &Path, folder: &Path, prefix: &str) -> io::Result<()> {
    if path.symlink_metadata().is_ok() {
        return Ok(());
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).permissions(Permissions::from_mode(OWN));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(&COUNTER)?;
    match file.persist_noclobber(path) {
        Err(refused) if refused.error.kind() != ErrorKind::AlreadyExists => Err(refused.error),
        _ => Ok(()),
    }
}

/// Returns the files of the network with their data, except for the one that keeps the prefix.
fn files(folder: &Path, prefix: &str) -> io::Result<Vec<(PathBuf, Metadata)>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let of_library = name.as_encoded_bytes().strip_prefix(prefix.as_bytes());
        if of_library.is_some_and(|rest| rest != LOCK_SUFFIX.as_bytes())
            // The file may have been removed in the meantime.
            && let Ok(data) = entry.metadata()
        {
            found.push((entry.path(), data));
        }
    }
    Ok(found)
}

/// Returns an unfinished file of this user.
fn find_unfinished(folder: &Path, prefix: &str) -> io::Result<Option<PathBuf>> {
    let unfinished = files(folder, prefix)?.into_iter().find(|(path, data)| {
        data.uid() == geteuid().as_raw()
            && (data.len() == 0 || data.mode() & OWN != OWN || is_bad_counter(path))
    });
    Ok(unfinished.map(|(path, _)| path))
}

/// Names the files of other users in the log, in one line.
fn name_strangers(folder: &Path, prefix: &str) -> io::Result<()> {
    let mut strangers = files(folder, prefix)?;
    strangers.retain(|(_, data)| data.uid() != geteuid().as_raw());
    if let Some((path, data)) = strangers.first() {
        tracing::warn!(
            files = strangers.len(),
            "{} of user {} has the prefix of this service, and is not used",
            path.display(),
            data.uid()
        );
    }
    Ok(())
}

fn foreign(data: &Metadata) -> Option<&'static str> {
    if data.uid() != geteuid().as_raw() {
        Some("belongs to another user")
    } else if !data.is_file() {
        Some("is not a file")
    } else if data.mode() & 0o077 != 0 {
        Some("can be opened by other users")
    } else {
        None
    }
}

/// Returns true for a counter that the library would not accept, or wait for without end.
fn is_bad_counter(path: &Path) -> bool {
    let is_counter = path.as_os_str().as_encoded_bytes().ends_with(COUNTER_NAME.as_bytes());
    is_counter
        && !fs::read(path).is_ok_and(|content| {
            content.len() == COUNTER.len() && content.get(..8) == COUNTER.get(..8)
        })
}
