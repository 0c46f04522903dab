//! Name of a bus interface, stored without allocation.

/// Largest number of interfaces that one source can receive from.
pub const MAX_INTERFACES: usize = 16;

/// Maximum length of an interface name \[bytes\]: IFNAMSIZ without the terminator.
const MAX_LENGTH: usize = 15;

/// Name of an interface, such as `can0`: 1 to 15 bytes of printable ASCII without a slash or a
/// colon.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct InterfaceName {
    bytes: [u8; MAX_LENGTH],
    length: u8,
}

impl InterfaceName {
    /// Checks the name and stores it as the kernel expects it.
    ///
    /// # Errors
    /// [`InterfaceNameError`] if no interface can have this name.
    pub fn new(name: &str) -> Result<Self, InterfaceNameError> {
        Self::from_bytes(name.as_bytes()).ok_or_else(|| InterfaceNameError { name: name.into() })
    }

    /// Creates a name like [`Self::new`]. Returns `None` if no interface can have this name.
    pub(crate) fn from_bytes(name: &[u8]) -> Option<Self> {
        let allowed = |byte: &u8| byte.is_ascii_graphic() && !matches!(byte, b'/' | b':');
        if name.is_empty() || !name.iter().all(allowed) || matches!(name, b"." | b"..") {
            return None;
        }
        let mut bytes = [0; MAX_LENGTH];
        bytes.get_mut(..name.len())?.copy_from_slice(name);
        Some(Self { bytes, length: u8::try_from(name.len()).ok()? })
    }

    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        let name = self.bytes.get(..usize::from(self.length)).unwrap_or_default();
        // The name contains only printable ASCII, so this cannot fail.
        core::str::from_utf8(name).unwrap_or_default()
    }
}

impl core::fmt::Display for InterfaceName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}

impl core::fmt::Debug for InterfaceName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl core::str::FromStr for InterfaceName {
    type Err = InterfaceNameError;

    fn from_str(name: &str) -> Result<Self, InterfaceNameError> {
        Self::new(name)
    }
}

/// Error for a name that no interface can have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{name:?} cannot be the name of an interface: 1 to 15 characters such as `can0`, without \
     space, slash or colon"
)]
pub struct InterfaceNameError {
    /// Name that was refused.
    pub name: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_that_the_kernel_takes() {
        for good in ["can0", "vcan1", "a", "exactly15bytes_"] {
            assert_eq!(InterfaceName::new(good).unwrap().as_str(), good);
        }
        for bad in ["", ".", "..", "can 0", "can/0", "can:0", "cän0", "sixteen_bytes_xx", "a\0"] {
            assert!(InterfaceName::new(bad).is_err(), "{bad:?}");
        }
    }
}
