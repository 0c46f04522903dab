//! A Unix socket with its permissions from the first moment, in the place of a dead one.

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

/// A listening socket; its name goes with it.
#[derive(Debug)]
pub struct Socket {
    listener: UnixListener,
    path: PathBuf,
    inode: u64,
}

/// Why a socket cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// A living process answers there. Stop it, or give this one another path.
    #[error("{} is in use by a running service", path.display())]
    InUse {
        /// The path.
        path: PathBuf,
    },
    /// Something that is no socket has the name. Remove it, or give another path.
    #[error("{} exists and is not a socket", path.display())]
    NotASocket {
        /// The path.
        path: PathBuf,
    },
    /// The system refused. The folder must exist and be writable, and a socket's path has 107
    /// bytes at most.
    #[error("cannot make the socket {}: {cause}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// The system's word.
        cause: io::Error,
    },
}

impl Socket {
    /// Listens at `path` with permissions `mode`. The name of a dead process is taken over.
    ///
    /// The socket is made in a folder of its own that nobody else can enter, gets its permissions
    /// there, and is then moved to its name: nobody can connect before, and there is no moment
    /// without one. The process's umask, which all threads share, is left alone.
    ///
    /// # Errors
    /// [`ListenError`].
    pub fn listen(path: &Path, mode: u32) -> Result<Self, ListenError> {
        let at = |cause| ListenError::Io { path: path.to_owned(), cause };
        refuse_living(path)?;
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let name = path.file_name().ok_or_else(|| at(io::ErrorKind::InvalidInput.into()))?;
        // One per process and socket; what a dead process of our number left is in the way.
        let mut private = std::ffi::OsString::from(format!(".{}.", std::process::id()));
        private.push(name);
        let private = folder.join(private);
        let _ = fs::remove_file(private.join("s"));
        let _ = fs::remove_dir(&private);
        DirBuilder::new().mode(0o700).create(&private).map_err(at)?;
        let made = make(&private.join("s"), path, mode);
        let _ = fs::remove_file(private.join("s"));
        let _ = fs::remove_dir(&private);
        let (listener, inode) = made.map_err(at)?;
        Ok(Self { listener, path: path.to_owned(), inode })
    }

    /// For tokio, which wants it without blocking.
    pub(super) fn tokio(&self) -> io::Result<tokio::net::UnixListener> {
        let listener = self.listener.try_clone()?;
        listener.set_nonblocking(true)?;
        tokio::net::UnixListener::from_std(listener)
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // Unless another has taken the name over.
        if fs::symlink_metadata(&self.path).is_ok_and(|data| data.ino() == self.inode) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn refuse_living(path: &Path) -> Result<(), ListenError> {
    let at = |cause| ListenError::Io { path: path.to_owned(), cause };
    match fs::symlink_metadata(path) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(cause) => return Err(at(cause)),
        Ok(data) if !data.file_type().is_socket() => {
            return Err(ListenError::NotASocket { path: path.to_owned() });
        }
        Ok(_) => {}
    }
    match UnixStream::connect(path) {
        Ok(_) => Err(ListenError::InUse { path: path.to_owned() }),
        Err(cause) if cause.kind() == io::ErrorKind::ConnectionRefused => Ok(()),
        Err(cause) => Err(at(cause)),
    }
}

fn make(private: &Path, path: &Path, mode: u32) -> io::Result<(UnixListener, u64)> {
    let listener = UnixListener::bind(private)?;
    fs::set_permissions(private, Permissions::from_mode(mode))?;
    let inode = fs::symlink_metadata(private)?.ino();
    fs::rename(private, path)?;
    Ok((listener, inode))
}
