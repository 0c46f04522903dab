//! Copy of a stream in a file without a name, which disappears however the process ends.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

/// The copy of a stream.
pub(super) struct Copy(File);

impl Copy {
    /// Creates an empty copy in a folder.
    pub(super) fn new_in(folder: &Path) -> io::Result<Self> {
        tempfile::tempfile_in(folder).map(Self)
    }

    /// Returns the file to write to.
    pub(super) fn file(&mut self) -> &mut File {
        &mut self.0
    }

    /// Returns a path at which the copy is read from its beginning.
    pub(super) fn path(&self) -> PathBuf {
        format!("/proc/self/fd/{}", self.0.as_raw_fd()).into()
    }
}

/// Returns true if a path is that of a pipe.
pub(super) fn is_pipe(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|of| of.file_type().is_fifo())
}
