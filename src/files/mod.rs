//! Files on disk: complete replacement, bounded reading, and folders of the own user.

mod disk;
#[cfg(target_os = "linux")]
mod folder;
mod replace;
#[cfg(test)]
pub(crate) mod simulated;
mod system;
mod text;

pub use disk::{Disk, DiskFile, remove_if_there, take_written_bytes, with_disk};
#[cfg(target_os = "linux")]
pub use folder::{FolderError, check_folder, own_folder, private_folder};
pub use replace::{discard_unfinished, remove_leftovers, replace, replace_link};
pub use system::{FileIdentity, FileSystemSpace, disk_space, file_number, identity, lock_folder};
pub use text::{MAX_TEXT_BYTES, TextError, decode_western, read_bytes, read_text};
