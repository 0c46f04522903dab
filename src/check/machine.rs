//! The machine on which a cell is checked, as far as its files describe it.

use std::fs;
use std::path::{Path, PathBuf};

/// Folders in which the kernel describes the machine. Tests replace them by their own folders.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Folder of the kernel's process files: `/proc`.
    pub proc: PathBuf,
    /// Folder of the kernel's device files: `/sys`.
    pub sys: PathBuf,
    /// Folder of shared memory: `/dev/shm`.
    pub shared_memory: PathBuf,
}

impl Default for Machine {
    fn default() -> Self {
        Self { proc: "/proc".into(), sys: "/sys".into(), shared_memory: "/dev/shm".into() }
    }
}

/// A network interface as described by sysfs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Interface {
    /// True if it is a CAN interface (ARPHRD_CAN).
    pub(super) is_can: bool,
    /// True if it is up (IFF_UP).
    pub(super) is_up: bool,
    /// Maximum transfer unit \[bytes\]: 16 for classic frames, 72 for CAN FD.
    pub(super) mtu: u32,
}

impl Machine {
    /// Returns the interface with this name. `None` if there is none.
    pub(super) fn interface(&self, name: &str) -> Option<Interface> {
        const ARPHRD_CAN: u32 = 280;
        const IFF_UP: u32 = 1;

        let folder = self.sys.join("class/net").join(name);
        let flags = read(&folder.join("flags"))?;
        let flags = u32::from_str_radix(flags.trim_start_matches("0x"), 16).ok()?;
        Some(Interface {
            is_can: read_number(&folder.join("type"))? == u64::from(ARPHRD_CAN),
            is_up: flags & IFF_UP != 0,
            mtu: read_number(&folder.join("mtu"))?.try_into().ok()?,
        })
    }

    /// Returns the names of the CAN interfaces, sorted.
    pub(super) fn can_interfaces(&self) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.sys.join("class/net")) else { return Vec::new() };
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut names: Vec<String> =
            names.filter(|name| self.interface(name).is_some_and(|is| is.is_can)).collect();
        names.sort();
        names
    }

    /// Returns the largest receive buffer that a process without privileges may request \[bytes\].
    pub(super) fn rmem_max(&self) -> Option<u64> {
        read_number(&self.proc.join("sys/net/core/rmem_max"))
    }

    /// Returns the memory available without swapping \[bytes\].
    pub(super) fn memory_available(&self) -> Option<u64> {
        let text = fs::read_to_string(self.proc.join("meminfo")).ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        kibibytes.checked_mul(1024)
    }
}

/// Returns the space available to an ordinary user on the file system of a path \[bytes\].
pub(super) fn space_left(path: &Path) -> Option<u64> {
    let space = rustix::fs::statvfs(path).ok()?;
    space.f_bavail.checked_mul(space.f_frsize)
}

fn read(file: &Path) -> Option<String> {
    Some(fs::read_to_string(file).ok()?.trim().to_owned())
}

fn read_number(file: &Path) -> Option<u64> {
    read(file)?.parse().ok()
}
