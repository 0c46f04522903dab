//! Streams as input files. A stream (standard input, a pipe) is copied, because input is read more
//! than once.

#[cfg(target_os = "linux")]
mod nameless;
#[cfg(not(target_os = "linux"))]
mod temporary;

use std::fs::File;
use std::io::{IsTerminal as _, Read};
use std::path::{Path, PathBuf};

use didim::report::html::InputFile;
#[cfg(target_os = "linux")]
use nameless::{Copy, is_pipe};
#[cfg(not(target_os = "linux"))]
use temporary::{Copy, is_pipe};

use super::CliError;
use super::progress::WorkIndicator;

/// Name of standard input on the command line.
const STANDARD_INPUT: &str = "-";
/// Maximum length of a stream's copy \[bytes\]: ten times the size of a table of one hour at 1 kHz.
const MAX_COPY_BYTES: u64 = 4 << 30;

/// Input of a command: a file, or the copy of a stream.
pub(super) struct InputFileOrStream {
    /// Name of the input in messages and reports.
    displayed_path: PathBuf,
    /// Path to open: that of the file, or that of the stream's copy.
    path: PathBuf,
    /// Copy of a stream.
    copy: Option<Copy>,
}

impl InputFileOrStream {
    /// Opens a file directly; copies a stream into the folder for temporary files.
    ///
    /// # Errors
    /// The stream cannot be read, or exceeds the maximum length, or there is no space for its copy.
    pub(super) fn open(source: &Path) -> Result<Self, CliError> {
        if source == Path::new(STANDARD_INPUT) {
            let stdin = std::io::stdin();
            if stdin.is_terminal() {
                let explanation = "--input - reads standard input, and that is a terminal; name a \
                    file, or redirect one: < FILE";
                return Err(CliError::Usage(explanation.to_owned()));
            }
            return Self::copy_stream("standard input".into(), &mut stdin.lock(), MAX_COPY_BYTES);
        }
        if !is_pipe(source) {
            return Ok(Self {
                displayed_path: source.to_owned(),
                path: source.to_owned(),
                copy: None,
            });
        }
        let mut pipe = File::open(source).map_err(|error| CliError::in_file(source, error))?;
        Self::copy_stream(source.to_owned(), &mut pipe, MAX_COPY_BYTES)
    }

    fn copy_stream(shown: PathBuf, from: &mut dyn Read, most: u64) -> Result<Self, CliError> {
        let folder = std::env::temp_dir();
        let refused = |error: std::io::Error| {
            let why = format!(
                "{error}; a stream is copied to {} to be read: set TMPDIR to a folder with room \
                 for it, or give a file",
                folder.display()
            );
            CliError::in_file(&shown, why)
        };
        let mut copy = Copy::new_in(&folder).map_err(refused)?;
        let copying = WorkIndicator::start(&format!("copying {}", shown.display()));
        let copied = copying.show_during(|| std::io::copy(&mut from.take(most + 1), copy.file()));
        let length = copied.map_err(refused)?;
        if length > most {
            let why = format!("a stream of more than {} GB; give a file", most >> 30);
            return Err(CliError::in_file(&shown, why));
        }
        if length == 0 {
            return Err(CliError::in_file(
                &shown,
                "standard input is empty; give a recording, or \
                a file",
            ));
        }
        Ok(Self { displayed_path: shown, path: copy.path(), copy: Some(copy) })
    }

    /// Returns true if the input is a stream. The name of a stream does not show its format.
    pub(super) fn is_stream(&self) -> bool {
        self.copy.is_some()
    }

    /// Returns the path to open.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the name of the input for messages and reports.
    pub(super) fn displayed_path(&self) -> &Path {
        &self.displayed_path
    }

    /// Replaces the path of the copy in an error by the displayed name.
    pub(super) fn with_displayed_path<T>(&self, of: Result<T, CliError>) -> Result<T, CliError> {
        if !self.is_stream() {
            return of;
        }
        let (path, shown) =
            (self.path.display().to_string(), self.displayed_path.display().to_string());
        of.map_err(|error| match error {
            CliError::Failed(why) => CliError::from_failure(why.to_string().replace(&path, &shown)),
            other => other,
        })
    }

    /// Returns the name, SHA-256 and date of the input.
    pub(super) fn input_file(&self) -> Result<InputFile, CliError> {
        let read = InputFile::read(&self.path);
        let read = read.map_err(|error| CliError::in_file(&self.displayed_path, error))?;
        let name = self.displayed_path.file_name().unwrap_or(self.displayed_path.as_os_str());
        // The date of a copy says nothing about the recording.
        let written = read.written.filter(|_| !self.is_stream());
        Ok(InputFile { name: name.to_string_lossy().into_owned(), written, ..read })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_read_as_often_as_wanted_and_leaves_nothing() {
        let input = InputFileOrStream::copy_stream("x".into(), &mut &b"abc"[..], 3).unwrap();
        for _ in 0..2 {
            assert_eq!(std::fs::read(input.path()).unwrap(), b"abc");
        }
        assert!(std::fs::metadata(input.path()).unwrap().is_file());
        let error = CliError::in_file(input.path(), "no end");
        let CliError::Failed(why) = input.with_displayed_path::<()>(Err(error)).unwrap_err() else {
            panic!()
        };
        assert_eq!(why.to_string(), "x: no end");
        assert_eq!(input.input_file().unwrap().name, "x");
    }

    #[test]
    fn a_stream_without_end_or_with_nothing_in_it_is_refused() {
        let why =
            |from: &mut dyn Read| match InputFileOrStream::copy_stream("x".into(), from, 1 << 20) {
                Err(CliError::Failed(why)) => why.to_string(),
                _ => panic!(),
            };
        assert!(why(&mut std::io::repeat(7)).contains("x: a stream of more than"));
        assert!(why(&mut std::io::empty()).contains("x: standard input is empty"));
    }
}
