//! Operations on files that the standard library does not have for every system.

#[cfg(target_os = "linux")]
mod linux;
#[cfg(not(target_os = "linux"))]
mod other;

#[cfg(target_os = "linux")]
pub use linux::{FileIdentity, disk_space, file_number, identity, lock_folder};
#[cfg(target_os = "linux")]
pub(super) use linux::{link, open_regular, sync_folder};
#[cfg(not(target_os = "linux"))]
pub use other::{FileIdentity, disk_space, file_number, identity, lock_folder};
#[cfg(not(target_os = "linux"))]
pub(super) use other::{link, open_regular, sync_folder};

/// Size of a file system and its space for an ordinary user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileSystemSpace {
    /// Size \[bytes\].
    pub size: u64,
    /// Free space \[bytes\].
    pub free: u64,
}
