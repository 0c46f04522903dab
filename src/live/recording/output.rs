//! The output files of recordings. A test may replace them to simulate failures.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

/// A file being written.
pub trait Output: Write + Send {
    /// Syncs the written data to disk.
    ///
    /// # Errors
    /// The file system's.
    fn sync(&mut self) -> io::Result<()>;
}

impl Output for BufWriter<File> {
    fn sync(&mut self) -> io::Result<()> {
        self.flush()?;
        self.get_ref().sync_all()
    }
}

/// Function that creates a file that does not exist yet.
pub type CreateOutput = Arc<dyn Fn(&Path) -> io::Result<Box<dyn Output>> + Send + Sync>;

/// Creates a file on disk and replaces an existing one.
///
/// # Errors
/// The file system's.
pub fn create_file(path: &Path) -> io::Result<Box<dyn Output>> {
    Ok(Box::new(BufWriter::new(File::create(path)?)))
}
