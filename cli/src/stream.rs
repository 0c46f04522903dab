//! What comes as a stream and is read more than once: standard input, a pipe.

use std::fs::File;
use std::io::{IsTerminal as _, Read};
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

use didim::report::html::InputFile;

use super::CliError;
use super::progress::Working;

/// Stands for standard input.
const STANDARD_INPUT: &str = "-";
/// What of a stream is kept at most \[bytes\]: ten times the table of a drive of an hour at 1 kHz.
const MOST: u64 = 4 << 30;

/// A file that is read, by whatever name it was given.
pub(super) struct Input {
    /// As people name it.
    shown: PathBuf,
    /// What is opened.
    path: PathBuf,
    /// The copy of a stream: a file without a name, of which nothing is left however this process ends.
    copy: Option<File>,
}

impl Input {
    /// A file as it is; of a stream, a copy in the folder for temporary files.
    ///
    /// # Errors
    /// The stream cannot be read, or has no end within bounds, or there is no room for its copy.
    pub(super) fn open(given: &Path) -> Result<Self, CliError> {
        if given == Path::new(STANDARD_INPUT) {
            let stdin = std::io::stdin();
            if stdin.is_terminal() {
                let what = "--input - reads standard input, and that is a terminal; name a file, or \
                            redirect one: < FILE";
                return Err(CliError::Usage(what.to_owned()));
            }
            return Self::copied("standard input".into(), &mut stdin.lock(), MOST);
        }
        let is_pipe = std::fs::metadata(given).is_ok_and(|of| of.file_type().is_fifo());
        if !is_pipe {
            return Ok(Self { shown: given.to_owned(), path: given.to_owned(), copy: None });
        }
        let mut pipe = File::open(given).map_err(|error| CliError::in_file(given, error))?;
        Self::copied(given.to_owned(), &mut pipe, MOST)
    }

    fn copied(shown: PathBuf, from: &mut dyn Read, most: u64) -> Result<Self, CliError> {
        let folder = std::env::temp_dir();
        let refused = |error: std::io::Error| {
            let why = format!(
                "{error}; a stream is copied to {} to be read: set TMPDIR to a folder with room for \
                 it, or give a file",
                folder.display()
            );
            CliError::in_file(&shown, why)
        };
        let mut copy = tempfile::tempfile_in(&folder).map_err(refused)?;
        let copying = Working::on(&format!("copying {}", shown.display()));
        let copied = copying.during(|| std::io::copy(&mut from.take(most + 1), &mut copy));
        let length = copied.map_err(refused)?;
        if length > most {
            let why = format!("a stream of more than {} GB; give a file", most >> 30);
            return Err(CliError::in_file(&shown, why));
        }
        if length == 0 {
            return Err(CliError::in_file(&shown, "nothing came; give a recording, or a file"));
        }
        // Opened anew, it is read from its beginning.
        let path = format!("/proc/self/fd/{}", copy.as_raw_fd()).into();
        Ok(Self { shown, path, copy: Some(copy) })
    }

    /// Whether it came as a stream, so that its name tells nothing.
    pub(super) fn is_stream(&self) -> bool {
        self.copy.is_some()
    }

    /// What is to be opened.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Its name for people.
    pub(super) fn shown(&self) -> &Path {
        &self.shown
    }

    /// The same with its name for people in place of the copy's.
    pub(super) fn named<T>(&self, of: Result<T, CliError>) -> Result<T, CliError> {
        if !self.is_stream() {
            return of;
        }
        let (path, shown) = (self.path.display().to_string(), self.shown.display().to_string());
        of.map_err(|error| match error {
            CliError::Failed(why) => CliError::failed(why.to_string().replace(&path, &shown)),
            other => other,
        })
    }

    /// Its name and its SHA-256, for a report.
    pub(super) fn provenance(&self) -> Result<InputFile, CliError> {
        let read = InputFile::read(&self.path);
        let read = read.map_err(|error| CliError::in_file(&self.shown, error))?;
        let name = self.shown.file_name().unwrap_or(self.shown.as_os_str());
        Ok(InputFile { name: name.to_string_lossy().into_owned(), ..read })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_read_as_often_as_wanted_and_leaves_nothing() {
        let input = Input::copied("x".into(), &mut &b"abc"[..], 3).unwrap();
        for _ in 0..2 {
            assert_eq!(std::fs::read(input.path()).unwrap(), b"abc");
        }
        assert!(std::fs::metadata(input.path()).unwrap().is_file());
        let error = CliError::in_file(input.path(), "no end");
        let CliError::Failed(why) = input.named::<()>(Err(error)).unwrap_err() else { panic!() };
        assert_eq!(why.to_string(), "x: no end");
        assert_eq!(input.provenance().unwrap().name, "x");
    }

    #[test]
    fn a_stream_without_end_or_with_nothing_in_it_is_refused() {
        let why = |from: &mut dyn Read| match Input::copied("x".into(), from, 1 << 20) {
            Err(CliError::Failed(why)) => why.to_string(),
            _ => panic!(),
        };
        assert!(why(&mut std::io::repeat(7)).contains("x: a stream of more than"));
        assert!(why(&mut std::io::empty()).contains("x: nothing came"));
    }
}
