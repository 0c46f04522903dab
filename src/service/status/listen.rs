//! A Unix socket. It has its permissions from the beginning, and replaces the socket of a dead
//! process.

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::net::{
    AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, listen, socket_with,
};

/// Number of connections that wait to be accepted.
const BACKLOG: i32 = 16;

/// A listening socket. When it is dropped, its name is removed.
#[derive(Debug)]
pub struct Socket {
    listener: UnixListener,
    path: PathBuf,
    inode: u64,
}

/// Reason why a socket cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// A live process answers at this path. Stop that process, or choose another path for this one.
    #[error("{} is in use by a running service", path.display())]
    InUse {
        /// The path.
        path: PathBuf,
    },
    /// The socket cannot be given to the group. The group must exist, and the service's user must
    /// be a member (`SupplementaryGroups=` in a unit).
    #[error(
        "cannot give the socket {} to the group `{group}`: {problem}; the group must exist and \
         the service's user be a member, as by SupplementaryGroups={group} in its unit",
        path.display()
    )]
    Group {
        /// The path.
        path: PathBuf,
        /// The group.
        group: String,
        /// The problem.
        problem: String,
    },
    /// The name belongs to a file that is not a socket. Remove it, or give another path.
    #[error("{} exists and is not a socket", path.display())]
    NotASocket {
        /// The path.
        path: PathBuf,
    },
    /// The system refused the operation. The folder must exist and be writable, and the path may
    /// have at most 107 bytes.
    #[error("cannot make the socket {}: {cause}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
}

/// Kind of a socket.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SocketKind {
    /// A stream of bytes.
    #[default]
    Stream,
    /// Packets, each of which arrives whole (SOCK_SEQPACKET).
    Packets,
}

impl SocketKind {
    fn bind(self, path: &Path) -> io::Result<UnixListener> {
        match self {
            Self::Stream => UnixListener::bind(path),
            Self::Packets => {
                let flags = SocketFlags::CLOEXEC;
                let socket = socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None)?;
                bind(&socket, &SocketAddrUnix::new(path)?)?;
                listen(&socket, BACKLOG)?;
                Ok(UnixListener::from(socket))
            }
        }
    }
}

impl Socket {
    /// Listens at `path` for streams; see [`Self::listen_for`].
    ///
    /// # Errors
    /// [`ListenError`].
    pub fn listen(path: &Path, mode: u32, group: Option<&str>) -> Result<Self, ListenError> {
        Self::listen_for(SocketKind::Stream, path, mode, group)
    }

    /// Listens at `path` for a kind of socket, with permissions `mode`, and with the group `group`
    /// if one is given. Replaces the socket of a dead process.
    ///
    /// The socket is created in a private folder that no other user can enter, and gets its
    /// permissions there. It is then renamed to `path`. No client can connect before it has its
    /// permissions, and a socket that is replaced exists until the renaming. The umask of the
    /// process, which all threads share, is not changed.
    ///
    /// # Errors
    /// [`ListenError`].
    pub fn listen_for(
        kind: SocketKind,
        path: &Path,
        mode: u32,
        group: Option<&str>,
    ) -> Result<Self, ListenError> {
        let io_error = |cause| ListenError::Io { path: path.to_owned(), cause };
        refuse_living(path)?;
        let group = group.map(|group| Ok((group, group_id(path, group)?))).transpose()?;
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let name = path.file_name().ok_or_else(|| io_error(io::ErrorKind::InvalidInput.into()))?;
        // Each process and socket has its own folder. A dead process with the same id may have left
        // its folder, which would prevent the creation.
        let mut private = std::ffi::OsString::from(format!(".{}.", std::process::id()));
        private.push(name);
        let private = folder.join(private);
        let _ = fs::remove_file(private.join("s"));
        let _ = fs::remove_dir(&private);
        make_private(&private).map_err(io_error)?;
        let made = bind_listener(&private.join("s"), (path, kind), mode, group);
        let _ = fs::remove_file(private.join("s"));
        let _ = fs::remove_dir(&private);
        let (listener, inode) = made?;
        Ok(Self { listener, path: path.to_owned(), inode })
    }

    /// Returns true if the path still refers to this socket. The file may have been removed, or
    /// replaced by that of another process.
    pub(crate) fn has_its_name(&self) -> bool {
        fs::symlink_metadata(&self.path).is_ok_and(|data| data.ino() == self.inode)
    }

    /// Returns the listener for tokio, which requires non-blocking mode.
    pub(crate) fn to_tokio(&self) -> io::Result<tokio::net::UnixListener> {
        let listener = self.listener.try_clone()?;
        listener.set_nonblocking(true)?;
        tokio::net::UnixListener::from_std(listener)
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // The file is not removed if another socket has replaced it.
        if self.has_its_name() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Creates a folder that no other user can enter. Refuses it if the file system gives it other
/// permissions.
fn make_private(folder: &Path) -> io::Result<()> {
    DirBuilder::new().mode(0o700).create(folder)?;
    require_private(folder)
}

/// Removes and refuses an empty folder that other users can enter.
fn require_private(folder: &Path) -> io::Result<()> {
    let mode = fs::symlink_metadata(folder)?.permissions().mode() & 0o777;
    if mode & 0o077 == 0 {
        return Ok(());
    }
    let _ = fs::remove_dir(folder);
    let why = format!("{} has the permissions {mode:o} instead of 700", folder.display());
    Err(io::Error::new(io::ErrorKind::PermissionDenied, why))
}

fn refuse_living(path: &Path) -> Result<(), ListenError> {
    let io_error = |cause| ListenError::Io { path: path.to_owned(), cause };
    match fs::symlink_metadata(path) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(cause) => return Err(io_error(cause)),
        Ok(data) if !data.file_type().is_socket() => {
            return Err(ListenError::NotASocket { path: path.to_owned() });
        }
        Ok(_) => {}
    }
    match UnixStream::connect(path) {
        Ok(_) => Err(ListenError::InUse { path: path.to_owned() }),
        Err(cause) if cause.kind() == io::ErrorKind::ConnectionRefused => Ok(()),
        // A living socket of the other kind.
        Err(cause) if cause.raw_os_error() == Some(Errno::PROTOTYPE.raw_os_error()) => {
            Err(ListenError::InUse { path: path.to_owned() })
        }
        Err(cause) => Err(io_error(cause)),
    }
}

fn bind_listener(
    private: &Path,
    (path, kind): (&Path, SocketKind),
    mode: u32,
    group: Option<(&str, u32)>,
) -> Result<(UnixListener, u64), ListenError> {
    let io_error = |cause| ListenError::Io { path: path.to_owned(), cause };
    let listener = kind.bind(private).map_err(io_error)?;
    if let Some((group, id)) = group {
        // The group is set before the permissions, because chown(2) may remove some permissions.
        std::os::unix::fs::chown(private, None, Some(id))
            .map_err(|cause| no_group(path, group, &cause))?;
    }
    fs::set_permissions(private, Permissions::from_mode(mode)).map_err(io_error)?;
    let inode = fs::symlink_metadata(private).map_err(io_error)?.ino();
    fs::rename(private, path).map_err(io_error)?;
    Ok((listener, inode))
}

fn group_id(path: &Path, name: &str) -> Result<u32, ListenError> {
    let group_found = nix::unistd::Group::from_name(name);
    match group_found.map_err(|cause| no_group(path, name, &cause))? {
        Some(group) => Ok(group.gid.as_raw()),
        None => Err(no_group(path, name, &"there is no such group")),
    }
}

fn no_group(path: &Path, group: &str, problem: &dyn core::fmt::Display) -> ListenError {
    let (path, group) = (path.to_owned(), group.to_owned());
    ListenError::Group { path, group, problem: problem.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_other_user_can_enter_the_private_folder() {
        let folder = tempfile::tempdir().unwrap();
        let private = folder.path().join("private");
        make_private(&private).unwrap();
        let mode = fs::metadata(&private).unwrap().permissions().mode() & 0o777;
        assert_eq!(format!("{mode:o}"), "700");
        // Some file systems give each folder the same permissions.
        fs::set_permissions(&private, Permissions::from_mode(0o755)).unwrap();
        let refused = require_private(&private).unwrap_err().to_string();
        assert!(refused.ends_with("has the permissions 755 instead of 700"), "{refused}");
        assert!(!private.exists());
    }
}
