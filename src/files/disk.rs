//! Changes of files on disk. The program's own data are changed only by these operations, so that a
//! test can simulate a disk that fails or forgets.

use std::cell::Cell;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use super::system;

thread_local! {
    /// Bytes that this thread has written since they were last taken.
    static WRITTEN_BYTES: Cell<u64> = const { Cell::new(0) };
}

/// A file that is being written.
pub trait DiskFile: Write + Send {
    /// Syncs content and size to the disk.
    ///
    /// # Errors
    /// Those of the file system.
    fn sync(&mut self) -> io::Result<()>;

    /// Cuts the file after this number of bytes.
    ///
    /// # Errors
    /// Those of the file system.
    fn cut(&mut self, length: u64) -> io::Result<()>;

    /// Returns the size of the file \[bytes\].
    ///
    /// # Errors
    /// Those of the file system.
    fn length(&self) -> io::Result<u64>;
}

/// Operations that change a disk. After a crash, content is certain after [`DiskFile::sync`], and
/// names are after [`Self::sync_folder`].
pub trait Disk {
    /// Creates a file that does not exist yet.
    ///
    /// # Errors
    /// Those of the file system.
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>>;

    /// Opens a file for appending, and creates it if it does not exist.
    ///
    /// # Errors
    /// Those of the file system.
    fn append(&self, path: &Path) -> io::Result<Box<dyn DiskFile>>;

    /// Renames a file or folder. A file with the new name is replaced.
    ///
    /// # Errors
    /// Those of the file system.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes a file.
    ///
    /// # Errors
    /// Those of the file system.
    fn remove(&self, path: &Path) -> io::Result<()>;

    /// Creates a symbolic link to a file of the same folder.
    ///
    /// # Errors
    /// Those of the file system.
    fn link(&self, target: &str, path: &Path) -> io::Result<()>;

    /// Creates a folder and its parents, if they do not exist.
    ///
    /// # Errors
    /// Those of the file system.
    fn make_folder(&self, path: &Path) -> io::Result<()>;

    /// Removes a folder with its content.
    ///
    /// # Errors
    /// Those of the file system.
    fn remove_folder(&self, path: &Path) -> io::Result<()>;

    /// Syncs the names in a folder to the disk.
    ///
    /// # Errors
    /// Those of the file system.
    fn sync_folder(&self, path: &Path) -> io::Result<()>;
}

/// The disk of the system.
#[derive(Clone, Copy, Debug)]
pub(super) struct SystemDisk;

/// A file on the disk of the system.
struct SystemFile(File);

impl Write for SystemFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.0.write(bytes)?;
        WRITTEN_BYTES.set(WRITTEN_BYTES.get() + written as u64);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl DiskFile for SystemFile {
    fn sync(&mut self) -> io::Result<()> {
        self.0.sync_all()
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.0.set_len(length)
    }

    fn length(&self) -> io::Result<u64> {
        Ok(self.0.metadata()?.len())
    }
}

impl Disk for SystemDisk {
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        Ok(Box::new(SystemFile(file)))
    }

    fn append(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        Ok(Box::new(SystemFile(OpenOptions::new().create(true).append(true).open(path)?)))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn link(&self, target: &str, path: &Path) -> io::Result<()> {
        system::link(target, path)
    }

    fn make_folder(&self, path: &Path) -> io::Result<()> {
        fs::create_dir_all(path)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir_all(path)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        system::sync_folder(path)
    }
}

/// Calls a function with the disk: the system's, unless a test has given this thread another one.
pub fn with_disk<T>(change: impl FnOnce(&dyn Disk) -> T) -> T {
    #[cfg(test)]
    if let Some(disk) = OTHER_DISK.with_borrow(Clone::clone) {
        return change(&*disk);
    }
    change(&SystemDisk)
}

/// Removes a file, if it exists.
///
/// # Errors
/// Those of the file system.
pub fn remove_if_there(path: &Path) -> io::Result<()> {
    match with_disk(|disk| disk.remove(path)) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(cause),
        _ => Ok(()),
    }
}

/// Returns the number of bytes that this thread has written since the last call.
pub fn take_written_bytes() -> u64 {
    WRITTEN_BYTES.take()
}

#[cfg(test)]
thread_local! {
    /// Disk of this thread in place of the system's.
    static OTHER_DISK: std::cell::RefCell<Option<std::rc::Rc<dyn Disk>>> =
        const { std::cell::RefCell::new(None) };
}

/// Gives this thread another disk, or the system's again.
#[cfg(test)]
pub(super) fn set_disk(disk: Option<std::rc::Rc<dyn Disk>>) {
    OTHER_DISK.set(disk);
}
