//! File system errors, with the attempted action and the path.

use std::io;
use std::path::{Path, PathBuf};

use crate::files::replace;

/// Error when storing a result.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused the operation. Check the permissions of the folder and the free
    /// space.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// The attempted operation.
        action: &'static str,
        /// Path that the operation used.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// Another process writes its results to this folder. End it, or name another folder.
    #[error(
        "{} is in use by another process; end it, or choose another folder for the results",
        folder.display()
    )]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// The record cannot be written as JSON. This is a program error.
    #[error("the result cannot be written as JSON: {0}")]
    Format(#[from] serde_json::Error),
}

pub(super) fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.to_owned();
    move |cause| StoreError::Io { action, path, cause }
}

/// Writes a complete file and replaces the previous one.
pub(super) fn write(path: &Path, content: &[u8]) -> Result<(), StoreError> {
    replace(path, |out| out.write_all(content)).map_err(io_error("write", path))
}
