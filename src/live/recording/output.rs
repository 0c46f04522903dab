//! The files that recordings are written to, so that a test may let them fail.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

/// A file being written.
pub trait Output: Write + Send {
    /// Brings what was written to the disk.
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

/// Makes a file that is not there yet.
pub type CreateOutput = Arc<dyn Fn(&Path) -> io::Result<Box<dyn Output>> + Send + Sync>;

/// Makes a file on disk, in place of one that is there.
///
/// # Errors
/// The file system's.
pub fn create_file(path: &Path) -> io::Result<Box<dyn Output>> {
    Ok(Box::new(BufWriter::new(File::create(path)?)))
}
