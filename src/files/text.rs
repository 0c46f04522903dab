//! Configuration files: text, in a regular file, of bounded size.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use rustix::fs::{Mode, OFlags};

/// Maximum size of a configuration file \[bytes\]. A DBC file of a complete vehicle has some
/// megabytes.
pub const MAX_TEXT_BYTES: u64 = 16 << 20;

/// Error when a configuration file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TextError {
    /// The file system refused. Check path and permissions.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The path is a folder, a device, a pipe or a socket.
    #[error("it is not a regular file; name a file, or copy its content to one")]
    NotAFile,
    /// The file is too large for a configuration.
    #[error(
        "it has more than {} MB, too many for a configuration; is it the right file?",
        MAX_TEXT_BYTES >> 20
    )]
    TooLarge,
    /// The file is not in UTF-8.
    #[error("line {line} is not UTF-8; save the file as UTF-8")]
    NotText {
        /// First unreadable line, counted from 1.
        line: usize,
    },
}

impl TextError {
    /// Returns true if the file does not exist.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Io(cause) if cause.kind() == io::ErrorKind::NotFound)
    }
}

/// Reads the text of a configuration file.
///
/// # Errors
/// [`TextError`].
pub fn read_text(path: &Path) -> Result<String, TextError> {
    String::from_utf8(read_bytes(path)?).map_err(|error| {
        let good = error.as_bytes().get(..error.utf8_error().valid_up_to()).unwrap_or_default();
        TextError::NotText { line: 1 + good.iter().filter(|byte| **byte == b'\n').count() }
    })
}

/// Reads the bytes of a configuration file of any encoding.
///
/// # Errors
/// [`TextError`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, TextError> {
    // `open` does not block on a pipe, and no byte is read from a device.
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let file = File::from(rustix::fs::open(path, flags, Mode::empty()).map_err(io::Error::from)?);
    if !file.metadata()?.is_file() {
        return Err(TextError::NotAFile);
    }
    let mut bytes = Vec::new();
    file.take(MAX_TEXT_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_TEXT_BYTES {
        return Err(TextError::TooLarge);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_and_all_else_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cell.toml");
        std::fs::write(&path, "a = 1\nb = \"ö\"\n").unwrap();
        assert_eq!(read_text(&path).unwrap(), "a = 1\nb = \"ö\"\n");
        std::fs::write(&path, b"a = 1\nb = \"\xf6\"\n").unwrap();
        assert!(matches!(read_text(&path), Err(TextError::NotText { line: 2 })));
        assert_eq!(read_bytes(&path).unwrap().len(), 14);
        assert!(read_text(&folder.path().join("none")).unwrap_err().is_missing());
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, Mode::RUSR | Mode::WUSR).unwrap();
        for odd in [folder.path(), Path::new("/dev/zero"), &pipe] {
            assert!(matches!(read_text(odd), Err(TextError::NotAFile)), "{}", odd.display());
        }
    }

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cell.toml");
        let file = File::create(&path).unwrap();
        file.set_len(MAX_TEXT_BYTES).unwrap();
        assert_eq!(read_bytes(&path).unwrap().len() as u64, MAX_TEXT_BYTES);
        file.set_len(MAX_TEXT_BYTES + 1).unwrap();
        assert!(matches!(read_bytes(&path), Err(TextError::TooLarge)));
    }
}
