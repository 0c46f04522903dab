//! Replacement of a file by another one, completely or not at all.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::disk::{remove_if_there, with_disk};

/// Suffix of a file that is being written. `.latest.json.Xy3aBc.tmp` becomes `latest.json`.
const TEMPORARY_SUFFIX: &str = ".tmp";

/// Files that this process is writing.
static UNFINISHED_FILES: UnfinishedFiles = UnfinishedFiles(Mutex::new(BTreeSet::new()));

/// Writes a new file in the same folder, syncs it, renames it to `path` and syncs the folder. After
/// a power cut, the name has the old content or the new one (rename(2), fsync(2)). The file has the
/// same read permissions as other files that the user creates.
///
/// # Errors
/// That of `write` or of the file system. The old file is untouched, unless the last step failed,
/// the sync of the folder.
pub fn replace<T>(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<T>,
) -> io::Result<T> {
    UNFINISHED_FILES.replace(path, write)
}

/// Replaces a file by a symbolic link to another one of the same folder. The link is either the old
/// file or the new link, also after a power cut. It is not synced: a start renews it.
///
/// # Errors
/// Those of the file system. The old file is untouched.
pub fn replace_link(path: &Path, target: &str) -> io::Result<()> {
    let mut name = OsString::from(".");
    name.push(path.file_name().ok_or(io::ErrorKind::InvalidInput)?);
    name.push(".link");
    name.push(TEMPORARY_SUFFIX);
    let temporary = path.with_file_name(name);
    remove_if_there(&temporary)?;
    with_disk(|disk| {
        disk.link(target, &temporary)?;
        disk.rename(&temporary, path)
    })
}

/// Removes the unfinished files of this process, for a process that ends during a write.
pub fn discard_unfinished() {
    UNFINISHED_FILES.discard();
}

/// Removes the unfinished files of killed processes from a folder, for names that `is_ours`
/// accepts. No other process may be writing them.
///
/// # Errors
/// Those of the file system.
pub fn remove_leftovers(folder: &Path, is_ours: impl Fn(&str) -> bool) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let replaced = name.to_str().and_then(|name| {
            name.strip_prefix('.')?
                .strip_suffix(TEMPORARY_SUFFIX)?
                .rsplit_once('.')
                .map(|(of, _)| of)
        });
        if replaced.is_some_and(&is_ours) {
            with_disk(|disk| disk.remove(&entry.path()))?;
        }
    }
    Ok(())
}

/// A list of files that are being written.
struct UnfinishedFiles(Mutex<BTreeSet<PathBuf>>);

impl UnfinishedFiles {
    fn replace<T>(
        &self,
        path: &Path,
        write: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<T>,
    ) -> io::Result<T> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut prefix = OsString::from(".");
        prefix.push(path.file_name().ok_or(io::ErrorKind::InvalidInput)?);
        prefix.push(".");
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(TEMPORARY_SUFFIX);
        // The error's own text contains the name of the temporary file, which does not help the
        // user.
        let file = builder.make_in(folder, |path| with_disk(|disk| disk.create(path)));
        let (file, temporary) = file.map_err(|error| io::Error::from(error.kind()))?.into_parts();
        let listed = self.list(&temporary);
        let mut buffered = BufWriter::new(file);
        let written = write(&mut buffered)?;
        let mut file = buffered.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.sync()?;
        drop(file);
        with_disk(|disk| disk.rename(&temporary, path))?;
        // The name is not there any more.
        let _ = temporary.keep();
        drop(listed);
        with_disk(|disk| disk.sync_folder(folder))?;
        Ok(written)
    }

    fn discard(&self) {
        for path in &*self.paths() {
            let _ = fs::remove_file(path);
        }
    }

    fn list(&self, path: &Path) -> UnfinishedEntry<'_> {
        self.paths().insert(path.to_owned());
        UnfinishedEntry { unfinished_files: self, path: path.to_owned() }
    }

    fn paths(&self) -> MutexGuard<'_, BTreeSet<PathBuf>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An entry of the list. It is removed when this value is dropped.
struct UnfinishedEntry<'a> {
    unfinished_files: &'a UnfinishedFiles,
    path: PathBuf,
}

impl Drop for UnfinishedEntry<'_> {
    fn drop(&mut self) {
        self.unfinished_files.paths().remove(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expectation::Expectation;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_the_old_one_or_the_new_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let expected = Expectation::of("result-half-written");
        let [old, new]: [String; 2] = expected.get("contents");
        replace(&path, |out| out.write_all(old.as_bytes())).unwrap();
        let failed: io::Result<()> = replace(&path, |out| {
            out.write_all(b"ne")?;
            assert_eq!(names(folder.path()).len(), 2, "next to its place");
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read_to_string(&path).unwrap(), old);
        let files: Vec<String> = expected.get("files");
        assert_eq!(names(folder.path()), files, "nothing is left next to it");
        replace(&path, |out| out.write_all(new.as_bytes())).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), new);
    }

    #[test]
    fn a_link_replaces_a_file_and_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("latest.json");
        fs::write(&path, "a copy, as of earlier versions").unwrap();
        for name in ["a.json", "b.json"] {
            fs::write(folder.path().join(name), name).unwrap();
            replace_link(&path, name).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), name);
        }
        assert_eq!(names(folder.path()), ["a.json", "b.json", "latest.json"]);
        assert_eq!(fs::read_to_string(folder.path().join("a.json")).unwrap(), "a.json");
    }

    #[test]
    fn what_is_being_written_can_be_discarded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        // A separate list: other tests of this process also write.
        let unfinished = UnfinishedFiles(Mutex::new(BTreeSet::new()));
        let written = unfinished.replace(&path, |out| {
            out.write_all(b"half")?;
            unfinished.discard();
            assert_eq!(names(folder.path()), Vec::<String>::new());
            Ok(())
        });
        assert!(written.is_err() && !path.exists());
        assert!(unfinished.paths().is_empty(), "a service writes for years");
    }

    #[test]
    fn only_the_own_leftovers_go() {
        let folder = tempfile::tempdir().unwrap();
        let written = [".a.json.Xy3aBc.tmp", ".b.json.Xy3aBc.tmp", ".a.json.tmp", "a.json"];
        for name in written {
            fs::write(folder.path().join(name), "").unwrap();
        }
        remove_leftovers(folder.path(), |name| name == "a.json").unwrap();
        assert_eq!(names(folder.path()), [".a.json.tmp", ".b.json.Xy3aBc.tmp", "a.json"]);
    }
}
