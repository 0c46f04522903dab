//! A folder of results for an earlier version of the program.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use didim_identification::identification::{ModelUncertainty, SCHEMA};
use serde_json::Value;

use super::error::{StoreError, io_error};
use super::folder::{DEFAULT_KEEP, Store};
use super::history::{history_parts, write_parsed_lines};
use crate::files::{read_bytes, replace, with_disk};

/// An earlier version whose layout can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EarlierVersion {
    /// 0.2: results of schema 1, and one file for the history.
    V0_2,
}

/// Reason why a folder is not written for an earlier version.
#[derive(Debug, thiserror::Error)]
pub enum EarlierVersionError {
    /// The folder cannot be opened or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// There is no such folder.
    #[error("{} is no folder of results; name it with --state", folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// A file has no valid content. Restore it, or move it away.
    #[error("{}: {problem}; restore the file, or move it away", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
}

/// Outcome of writing a folder for an earlier version.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EarlierLayout {
    /// Number of results, and of baselines, that were rewritten.
    pub rewritten: usize,
    /// Number of lines in the history: results, and rows of days.
    pub lines: usize,
    /// Number of files that were moved into the subfolder [`NEWER_FOLDER`].
    pub files_moved: usize,
}

/// Subfolder for the files that the earlier version does not read.
pub const NEWER_FOLDER: &str = "newer";
/// The history while it is complete and not in its place yet. If the command was interrupted, the
/// next call continues with it.
const COMPLETE_HISTORY: &str = "history-complete.jsonl";
const HISTORY: &str = "history.jsonl";
const BASELINE: &str = "baseline.json";

impl EarlierVersion {
    /// Parses the number of a version: `0.2`, or `0.2.0`.
    pub fn parse(text: &str) -> Option<Self> {
        matches!(text, "0.2" | "0.2.0").then_some(Self::V0_2)
    }

    /// Writes the files of a folder so that this version reads them. The folder must not be in use.
    /// Can be called again after an interruption. This version still reads the folder.
    ///
    /// # Errors
    /// [`EarlierVersionError`].
    pub fn write_folder(self, folder: &Path) -> Result<EarlierLayout, EarlierVersionError> {
        if !folder.is_dir() {
            return Err(EarlierVersionError::NoFolder { folder: folder.to_owned() });
        }
        let Self::V0_2 = self;
        // Locks the folder, completes the history, and removes incomplete files.
        let store = Store::open(folder, DEFAULT_KEEP)?;
        let mut layout = EarlierLayout::default();
        let files: Vec<PathBuf> =
            store.result_files()?.into_iter().chain([folder.join(BASELINE)]).collect();
        // A damaged file stops the work before it begins.
        for path in &files {
            in_schema_1(path)?;
        }
        for path in files {
            if let Some(json) = in_schema_1(&path)? {
                replace(&path, |out| out.write_all(&json)).map_err(io_error("write", &path))?;
                layout.rewritten += 1;
            }
        }
        (layout.lines, layout.files_moved) = join_history(folder)?;
        drop(store);
        Ok(layout)
    }
}

/// Returns a result or a baseline in the layout of schema 1, or `None` if it is so already, or not
/// there.
fn in_schema_1(path: &Path) -> Result<Option<Vec<u8>>, EarlierVersionError> {
    let content = match read_bytes(path) {
        Err(problem) if problem.is_missing() => return Ok(None),
        content => content,
    };
    let wrong = |problem: String| EarlierVersionError::Format { path: path.to_owned(), problem };
    let content = content.map_err(|problem| wrong(problem.to_string()))?;
    let mut value: Value =
        serde_json::from_slice(&content).map_err(|problem| wrong(problem.to_string()))?;
    let later = value.get("schema").and_then(Value::as_u64).filter(|of| *of > SCHEMA.into());
    if let Some(later) = later {
        return Err(wrong(format!("it has schema {later}, of a later version than this one")));
    }
    let mut is_changed = lower_schema(&mut value);
    // A baseline has the uncertainty itself.
    let holder = match value.get_mut("estimate") {
        Some(estimate) => {
            is_changed |= lower_schema(estimate);
            estimate
        }
        None => &mut value,
    };
    if let Some(stored) = holder.get_mut("model_uncertainty").filter(|of| !of.is_null())
        && stored.get("covariance").is_none()
    {
        let uncertainty: ModelUncertainty = serde_json::from_value(stored.take())
            .map_err(|problem| wrong(format!("model_uncertainty: {problem}")))?;
        *stored = serde_json::to_value(uncertainty.to_schema_1()).map_err(StoreError::Format)?;
        is_changed = true;
    }
    if !is_changed {
        return Ok(None);
    }
    let mut json = serde_json::to_vec(&value).map_err(StoreError::Format)?;
    json.push(b'\n');
    Ok(Some(json))
}

/// Replaces schema 2 by 1.
fn lower_schema(value: &mut Value) -> bool {
    match value.get_mut("schema") {
        Some(schema) if schema.as_u64() == Some(2) => {
            *schema = 1.into();
            true
        }
        _ => false,
    }
}

/// Joins the parts of the history in one file, and moves the others away. Returns the number of
/// lines and of moved files.
fn join_history(folder: &Path) -> Result<(usize, usize), StoreError> {
    let (complete, history) = (folder.join(COMPLETE_HISTORY), folder.join(HISTORY));
    let parts = history_parts(folder).map_err(io_error("read the folder", folder))?;
    if parts.is_empty() && !complete.exists() {
        return Ok((0, 0));
    }
    let mut lines = 0;
    if !complete.exists() {
        let written = replace(&complete, |out| {
            lines = write_parsed_lines(folder, out)?;
            Ok(())
        });
        written.map_err(io_error("write", &complete))?;
    }
    let newer = folder.join(NEWER_FOLDER);
    let files_moved = move_all(&parts, &newer).map_err(io_error("move files to", &newer))?;
    let placed = with_disk(|disk| {
        disk.rename(&complete, &history)?;
        disk.sync_folder(folder)
    });
    placed.map_err(io_error("write", &history))?;
    Ok((lines, files_moved))
}

fn move_all(paths: &[PathBuf], folder: &Path) -> io::Result<usize> {
    if paths.is_empty() {
        return Ok(0);
    }
    with_disk(|disk| disk.make_folder(folder))?;
    for path in paths {
        // An earlier call may have left a file of this name.
        let target = free_name(folder, path);
        with_disk(|disk| disk.rename(path, &target))?;
    }
    with_disk(|disk| disk.sync_folder(folder))?;
    Ok(paths.len())
}

/// Returns a path in a folder that is not taken, with the name of a file if possible.
fn free_name(folder: &Path, path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default();
    let numbered = (1..).map(|number: u32| {
        let mut name = name.to_owned();
        name.push(format!(".{number}"));
        folder.join(name)
    });
    let mut names = core::iter::once(folder.join(name)).chain(numbered);
    names.find(|target| fs::symlink_metadata(target).is_err()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::store::read_history;

    #[test]
    fn only_known_versions_are_written() {
        for version in ["0.2", "0.2.0"] {
            assert_eq!(EarlierVersion::parse(version), Some(EarlierVersion::V0_2));
        }
        for version in ["", "0.1.0", "0.3.0", "0.2.1", "2"] {
            assert_eq!(EarlierVersion::parse(version), None);
        }
    }

    /// A damaged result, and one of a later version: the folder stays as it is.
    #[test]
    fn a_damaged_file_stops_the_work_before_it_begins() {
        for (damaged, says) in [("{\"schema\":2", "EOF"), ("{\"schema\":7}", "schema 7")] {
            let folder = tempfile::tempdir().unwrap();
            let result = |number| folder.path().join(format!("result-{number:08}.json"));
            fs::write(result(0), "{\"schema\":2}").unwrap();
            fs::write(result(1), damaged).unwrap();
            let refused = EarlierVersion::V0_2.write_folder(folder.path()).unwrap_err().to_string();
            assert!(
                refused.contains("result-00000001.json") && refused.contains(says),
                "{refused}"
            );
            assert_eq!(fs::read_to_string(result(0)).unwrap(), "{\"schema\":2}");
        }
    }

    #[test]
    fn an_empty_folder_needs_nothing_and_a_missing_one_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let written = EarlierVersion::V0_2.write_folder(folder.path()).unwrap();
        assert_eq!(written, EarlierLayout::default());
        assert!(read_history(folder.path()).is_err());
        let missing = EarlierVersion::V0_2.write_folder(&folder.path().join("none"));
        assert!(matches!(missing, Err(EarlierVersionError::NoFolder { .. })));
    }
}
