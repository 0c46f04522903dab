//! The configurations that results were made with, each kept once under its hash.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::error::{StoreError, at, write};
use crate::text::is_digest;

const FOLDER: &str = "configurations";
const WRITING: &str = ".writing.tmp";

/// The files of a configuration as they were read: its hash is taken over them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfigurationTexts {
    /// The cell file.
    pub cell: String,
    /// The robot file.
    pub robot: String,
    /// What the layout was made from, by the names that they are kept under: the DBC file, or the
    /// device files of the nodes.
    pub layout: Vec<(String, String)>,
}

impl ConfigurationTexts {
    fn files(&self) -> impl Iterator<Item = (&str, &str)> {
        let layout = self.layout.iter().map(|(name, text)| (name.as_str(), text.as_str()));
        [("cell.toml", self.cell.as_str()), ("robot.toml", &self.robot)].into_iter().chain(layout)
    }
}

/// `configurations/<sha256>/` in the folder of the results, with `cell.toml`, `robot.toml` and the
/// files of the layout.
#[derive(Debug)]
pub(super) struct Configurations {
    folder: PathBuf,
}

impl Configurations {
    pub(super) fn beside_results(folder: &Path) -> Self {
        Self { folder: folder.join(FOLDER) }
    }

    /// Writes a configuration unless it is there. Its files are written and synced beside its place
    /// first, so that a folder with its name is whole.
    pub(super) fn keep(&self, sha256: &str, texts: &ConfigurationTexts) -> Result<(), StoreError> {
        let place = self.folder.join(sha256);
        if !is_digest(sha256) || place.is_dir() {
            return Ok(());
        }
        let writing = self.folder.join(WRITING);
        clear(&writing)?;
        fs::create_dir_all(&writing).map_err(at("make the folder", &writing))?;
        for (name, text) in texts.files() {
            let path = writing.join(name);
            write(&path, text.as_bytes())?;
        }
        fs::rename(&writing, &place).map_err(at("rename a configuration to", &place))?;
        sync(&self.folder)
    }

    /// The hashes of those that are there.
    pub(super) fn kept(&self) -> Result<Vec<String>, StoreError> {
        let entries = match fs::read_dir(&self.folder) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(at("read the folder", &self.folder))?,
        };
        let mut kept = Vec::new();
        for entry in entries {
            let entry = entry.map_err(at("read the folder", &self.folder))?;
            kept.extend(entry.file_name().into_string().ok().filter(|name| is_digest(name)));
        }
        kept.sort_unstable();
        Ok(kept)
    }

    pub(super) fn remove(&self, sha256: &str) -> Result<(), StoreError> {
        clear(&self.folder.join(sha256))
    }

    /// Removes what a process was writing when it died.
    pub(super) fn clear_unfinished(&self) -> Result<(), StoreError> {
        clear(&self.folder.join(WRITING))
    }
}

fn clear(folder: &Path) -> Result<(), StoreError> {
    match fs::remove_dir_all(folder) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(at("remove", folder)(cause)),
        _ => Ok(()),
    }
}

fn sync(folder: &Path) -> Result<(), StoreError> {
    File::open(folder).and_then(|opened| opened.sync_all()).map_err(at("sync", folder))
}
