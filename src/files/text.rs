//! Configuration files: text, in a regular file, of bounded size.

use std::io::{self, Read as _};
use std::path::Path;

use encoding_rs::{Encoding, WINDOWS_1252};

use super::system::open_regular;

/// Maximum size of a configuration file \[bytes\]. A DBC file of a complete vehicle has some
/// megabytes.
pub const MAX_TEXT_BYTES: u64 = 16 << 20;

/// Length of the text in which an XML declaration is searched \[bytes\]. Convention.
const DECLARATION_BYTES: usize = 512;

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

/// Reads the text of a configuration file: UTF-8, or another encoding that an XML declaration or a
/// byte order mark states.
///
/// # Errors
/// [`TextError`].
pub fn read_text(path: &Path) -> Result<String, TextError> {
    String::from_utf8(read_bytes(path)?).or_else(|error| {
        let good = error.utf8_error().valid_up_to();
        decode_declared(error.as_bytes()).ok_or_else(|| {
            let good = error.as_bytes().get(..good).unwrap_or_default();
            TextError::NotText { line: 1 + good.iter().filter(|byte| **byte == b'\n').count() }
        })
    })
}

/// Decodes a text that states its encoding; `None` if it states none, or its bytes are not in it.
fn decode_declared(bytes: &[u8]) -> Option<String> {
    let marked = Encoding::for_bom(bytes).map(|(encoding, _)| encoding);
    let encoding = marked.or_else(|| {
        let start = String::from_utf8_lossy(bytes.get(..DECLARATION_BYTES).unwrap_or(bytes));
        let (declaration, _) = start.trim_start().strip_prefix("<?xml")?.split_once("?>")?;
        let (_, value) = declaration.split_once("encoding")?;
        let value = value.trim_start().strip_prefix('=')?.trim_start();
        let label = value.split(['"', '\'']).nth(1)?;
        Encoding::for_label(label.as_bytes())
    })?;
    let (text, _, has_errors) = encoding.decode(bytes);
    (!has_errors).then(|| text.into_owned())
}

/// Decodes a text of the automation industry: UTF-8, or else Windows-1252, in which every byte is a
/// letter.
pub fn decode_western(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes)
        .unwrap_or_else(|error| WINDOWS_1252.decode(error.as_bytes()).0.into_owned())
}

/// Reads the bytes of a configuration file of any encoding.
///
/// # Errors
/// [`TextError`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, TextError> {
    // No byte is read from a device.
    let file = open_regular(path)?;
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
    use std::fs::File;

    #[test]
    fn text_is_read_and_all_else_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cell.toml");
        std::fs::write(&path, "a = 1\nb = \"ö\"\n").unwrap();
        assert_eq!(read_text(&path).unwrap(), "a = 1\nb = \"ö\"\n");
        std::fs::write(&path, b"a = 1\nb = \"\xf6\"\n").unwrap();
        assert!(matches!(read_text(&path), Err(TextError::NotText { line: 2 })));
        assert_eq!(read_bytes(&path).unwrap().len(), 14);
        let declared = b"\n<?xml version='1.0' encoding='ISO-8859-1'?><a b='\xf6'/>";
        std::fs::write(&path, declared).unwrap();
        assert!(read_text(&path).unwrap().ends_with("<a b='ö'/>"));
        std::fs::write(&path, b"\xff\xfe<\0a\0").unwrap();
        assert_eq!(read_text(&path).unwrap(), "<a");
        // It states an encoding that it is not in.
        std::fs::write(&path, b"<?xml encoding=\"utf-8\"?>\n<a b='\xf6'/>").unwrap();
        assert!(matches!(read_text(&path), Err(TextError::NotText { line: 2 })));
        assert_eq!(decode_western(b"\xf6 \x80".to_vec()), "ö €");
        assert!(read_text(&folder.path().join("none")).unwrap_err().is_missing());
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR).unwrap();
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
