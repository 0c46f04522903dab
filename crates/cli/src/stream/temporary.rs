//! Copy of a stream in a temporary file, for systems without files that have no name.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// The copy of a stream.
pub(super) struct Copy(NamedTempFile);

impl Copy {
    /// Creates an empty copy in a folder.
    pub(super) fn new_in(folder: &Path) -> io::Result<Self> {
        NamedTempFile::new_in(folder).map(Self)
    }

    /// Returns the file to write to.
    pub(super) fn file(&mut self) -> &mut File {
        self.0.as_file_mut()
    }

    /// Returns the path of the copy.
    pub(super) fn path(&self) -> PathBuf {
        self.0.path().to_owned()
    }
}

/// Returns false: only standard input is a stream.
pub(super) fn is_pipe(_: &Path) -> bool {
    false
}
