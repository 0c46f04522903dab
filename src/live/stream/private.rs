//! A network for one run of a program, of which nothing stays.

use std::fs;
use std::path::{Path, PathBuf};

use super::prefault::SHARED_MEMORY;

/// Removes at its end what the library leaves of a network with a prefix and a root of its own: a
/// small file in /dev/shm per prefix, and the root. For a demonstration or a replay; a service
/// keeps its prefix and leaves one such file, for ever the same.
///
/// Make it before the first node of the network, so that it is dropped after the last.
#[derive(Debug)]
pub struct PrivateNetwork {
    root: PathBuf,
    prefix: String,
}

impl PrivateNetwork {
    /// For the network with exactly this root and prefix. Nobody else may use either, and the
    /// prefix must not be the beginning of another's: end it with a `_`.
    pub fn new(root: &Path, prefix: &str) -> Self {
        Self { root: root.to_owned(), prefix: prefix.to_owned() }
    }
}

impl Drop for PrivateNetwork {
    fn drop(&mut self) {
        // With nothing in front, every network's files would be ours.
        if self.prefix.is_empty() {
            return;
        }
        let files = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
        for file in files {
            if file.file_name().to_string_lossy().starts_with(&self.prefix) {
                let _ = fs::remove_file(file.path());
            }
        }
        let _ = fs::remove_dir_all(&self.root);
    }
}
