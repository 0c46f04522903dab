//! Source of configuration files: the disk, or texts in memory, as the copies inside the program.
//! The copies let a demonstration run without installed files.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use super::CellError;
use crate::files::{decode_western, read_bytes, read_text};

/// The shipped files, each with its path below `config/`.
pub const SHIPPED_FILES: &[(&str, &str)] = &[
    ("config/robots/tx40.toml", include_str!("../../config/robots/tx40.toml")),
    ("config/robots/tx40-physical.toml", include_str!("../../config/robots/tx40-physical.toml")),
    ("config/dbc/cia402_six_axes.dbc", include_str!("../../config/dbc/cia402_six_axes.dbc")),
    ("config/eds/cia402_drive.eds", include_str!("../../config/eds/cia402_drive.eds")),
    ("config/eni/cia402_six_drives.xml", include_str!("../../config/eni/cia402_six_drives.xml")),
    ("config/dbc/packed_fd_six_axes.dbc", include_str!("../../config/dbc/packed_fd_six_axes.dbc")),
    ("config/cells/tx40-packed-fd.toml", include_str!("../../config/cells/tx40-packed-fd.toml")),
    ("config/cells/tx40-paper.toml", include_str!("../../config/cells/tx40-paper.toml")),
    ("config/cells/tx40-cia402.toml", include_str!("../../config/cells/tx40-cia402.toml")),
    ("config/cells/tx40-cia402-eds.toml", include_str!("../../config/cells/tx40-cia402-eds.toml")),
    ("config/cells/tx40-ethercat.toml", include_str!("../../config/cells/tx40-ethercat.toml")),
];

/// A source of configuration files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Library<'a> {
    /// Files on disk.
    Files,
    /// Files on disk. Each text is recorded with its path, for a copy on another machine.
    Recording(&'a RefCell<Vec<(PathBuf, String)>>),
    /// Texts in memory, each with its path.
    Texts(&'a [(&'a str, &'a str)]),
}

impl Library<'_> {
    /// The copies inside the program.
    pub const SHIPPED: Self = Self::Texts(SHIPPED_FILES);

    /// Returns the text of a file.
    ///
    /// # Errors
    /// [`CellError::Read`].
    pub fn read(self, path: &Path) -> Result<String, CellError> {
        let text = match self {
            Self::Files => read_text(path),
            Self::Recording(files) => read_text(path).inspect(|text| record(files, path, text)),
            Self::Texts(texts) => {
                let path = normalise(path);
                let named = texts.iter().find(|(name, _)| Path::new(name) == path);
                named
                    .map(|(_, text)| (*text).to_owned())
                    .ok_or_else(|| std::io::Error::from(std::io::ErrorKind::NotFound).into())
            }
        };
        text.map_err(|source| CellError::Read { file: path.to_path_buf(), source })
    }

    /// Returns the text of a DBC, EDS, DCF or ENI file. Many of these files are in Windows-1252.
    ///
    /// # Errors
    /// [`CellError::Read`].
    pub fn read_device_file(self, path: &Path) -> Result<String, CellError> {
        match self {
            Self::Texts(_) => self.read(path),
            Self::Files | Self::Recording(_) => read_bytes(path)
                .map(decode_western)
                .inspect(|text| {
                    if let Self::Recording(files) = self {
                        record(files, path, text);
                    }
                })
                .map_err(|source| CellError::Read { file: path.to_path_buf(), source }),
        }
    }
}

fn record(files: &RefCell<Vec<(PathBuf, String)>>, path: &Path, text: &str) {
    files.borrow_mut().push((normalise(path), text.to_owned()));
}

/// Removes `..` from a path: `config/cells/../robots/tx40.toml` becomes `config/robots/tx40.toml`.
fn normalise(path: &Path) -> std::path::PathBuf {
    use std::path::Component;

    path.components().fold(std::path::PathBuf::new(), |mut joined, part| {
        match part {
            Component::ParentDir => {
                joined.pop();
            }
            Component::CurDir => {}
            other => joined.push(other),
        }
        joined
    })
}
