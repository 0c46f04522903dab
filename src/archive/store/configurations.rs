//! The configurations of the results. Each is stored once, under its hash.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::error::{StoreError, io_error, write};
use crate::files::with_disk;
use crate::text::is_digest;

const FOLDER_NAME: &str = "configurations";
const TEMPORARY_SUFFIX: &str = ".writing.tmp";

/// The files of a configuration as they were read. The hash covers them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfigurationTexts {
    /// The cell file.
    pub cell: String,
    /// The robot file.
    pub robot: String,
    /// Source files of the layout, each with its name in the stored copy: the DBC file, or the
    /// device files of the nodes.
    pub layout: Vec<(String, String)>,
}

impl ConfigurationTexts {
    fn files(&self) -> impl Iterator<Item = (&str, &str)> {
        let layout = self.layout.iter().map(|(name, text)| (name.as_str(), text.as_str()));
        [("cell.toml", self.cell.as_str()), ("robot.toml", &self.robot)].into_iter().chain(layout)
    }
}

/// The folder `configurations` in the results folder. It has a subfolder `<sha256>` for each
/// configuration, with `cell.toml`, `robot.toml` and the files of the layout.
#[derive(Debug)]
pub(super) struct Configurations {
    folder: PathBuf,
}

impl Configurations {
    pub(super) fn next_to_results(folder: &Path) -> Self {
        Self { folder: folder.join(FOLDER_NAME) }
    }

    /// Writes a configuration unless it is stored already. Writes and syncs its files in a
    /// temporary folder first, so that a folder with the final name is always complete.
    pub(super) fn store_texts(
        &self,
        sha256: &str,
        texts: &ConfigurationTexts,
    ) -> Result<(), StoreError> {
        let place = self.folder.join(sha256);
        if !is_digest(sha256) || place.is_dir() {
            return Ok(());
        }
        let writing = self.folder.join(TEMPORARY_SUFFIX);
        clear(&writing)?;
        with_disk(|disk| disk.make_folder(&writing))
            .map_err(io_error("make the folder", &writing))?;
        for (name, text) in texts.files() {
            let path = writing.join(name);
            write(&path, text.as_bytes())?;
        }
        with_disk(|disk| disk.rename(&writing, &place))
            .map_err(io_error("rename a configuration to", &place))?;
        sync(&self.folder)
    }

    /// Returns the hashes of the stored configurations.
    pub(super) fn stored_hashes(&self) -> Result<Vec<String>, StoreError> {
        let entries = match fs::read_dir(&self.folder) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(io_error("read the folder", &self.folder))?,
        };
        let mut hashes = Vec::new();
        for entry in entries {
            let entry = entry.map_err(io_error("read the folder", &self.folder))?;
            hashes.extend(entry.file_name().into_string().ok().filter(|name| is_digest(name)));
        }
        hashes.sort_unstable();
        Ok(hashes)
    }

    pub(super) fn remove(&self, sha256: &str) -> Result<(), StoreError> {
        clear(&self.folder.join(sha256))
    }

    /// Removes incomplete files that a killed process has left behind.
    pub(super) fn clear_unfinished(&self) -> Result<(), StoreError> {
        clear(&self.folder.join(TEMPORARY_SUFFIX))
    }
}

fn clear(folder: &Path) -> Result<(), StoreError> {
    match with_disk(|disk| disk.remove_folder(folder)) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
            Err(io_error("remove", folder)(cause))
        }
        _ => Ok(()),
    }
}

fn sync(folder: &Path) -> Result<(), StoreError> {
    with_disk(|disk| disk.sync_folder(folder)).map_err(io_error("sync", folder))
}
