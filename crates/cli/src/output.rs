//! Writes to stdout and to files; a file appears complete or not at all.

use std::ffi::OsStr;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use didim_identification::identification::Identification;
use serde::Serialize;

use super::CliError;
use didim::cell::Cell;
use didim::files::{identity, replace};
use didim::report::figure::torque_figure;
use didim::report::html::Report;
use didim::report::joint_panels;

/// Writes to stdout. It is not an error if the reader has closed its end of the pipe (`didim … |
/// head`).
pub(super) fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::from_failure(error))
        }
        _ => Ok(()),
    }
}

/// Writes one JSON value and a line end to stdout. A part of it is in memory at a time.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), CliError> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    let written = serde_json::to_writer(&mut out, value).map_err(std::io::Error::from);
    match written.and_then(|()| out.write_all(b"\n")).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::from_failure(error))
        }
        _ => Ok(()),
    }
}

/// Writes a file completely or not at all; see [`replace`].
pub(super) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> Result<(), CliError>,
) -> Result<(), CliError> {
    check_place(path)?;
    let mut refused = None;
    let replaced = replace(path, |out| {
        write(out).map_err(|error| {
            refused = Some(error);
            std::io::ErrorKind::Other.into()
        })
    });
    replaced.map_err(|error| refused.unwrap_or_else(|| write_error(path, &error)))
}

/// Checks the files that a command will write, before any work. Each file needs a permitted place
/// and must not be an input file.
///
/// # Errors
/// Those of [`check_place`] and [`check_is_new`].
pub(super) fn check_outputs<'a>(
    written: impl IntoIterator<Item = &'a PathBuf>,
    read: &[&Path],
) -> Result<(), CliError> {
    for path in written {
        check_place(path)?;
        check_is_new(path, read)?;
    }
    Ok(())
}

/// Checks the place of a file to be written: files can be created in its folder, and the path is
/// free or that of a regular file. A regular file is replaced when the new one is complete; a
/// device, pipe or socket must not be replaced.
///
/// # Errors
/// Names the file and the remedy.
pub(super) fn check_place(path: &Path) -> Result<(), CliError> {
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return Err(CliError::in_file(
            path,
            "exists and is not a regular file; choose another name",
        ));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    std::fs::read_dir(folder).map_err(|error| write_error(path, &error))?;
    // A temporary file without a name disappears in any case, even after a crash.
    tempfile::tempfile_in(folder).map(drop).map_err(|error| write_error(path, &error))
}

/// Checks a folder in which files will be written. It may be created.
///
/// # Errors
/// Names the folder and the remedy.
pub(super) fn check_folder(path: &Path) -> Result<(), CliError> {
    let wrong = |error: &std::io::Error| {
        CliError::in_file(path, format!("{error}; name a writable folder"))
    };
    std::fs::create_dir_all(path).map_err(|error| wrong(&error))?;
    tempfile::tempfile_in(path).map(drop).map_err(|error| wrong(&error))
}

/// Checks that a file to be written is not one of the input files.
///
/// # Errors
/// Names the file and the remedy.
fn check_is_new(path: &Path, read: &[&Path]) -> Result<(), CliError> {
    let own = identity(path);
    match own.is_some() && read.iter().any(|other| identity(other) == own) {
        true => {
            Err(CliError::in_file(path, "is read by this command; name another file to be written"))
        }
        false => Ok(()),
    }
}

pub(super) fn write_error(path: &Path, error: &std::io::Error) -> CliError {
    // The error of a temporary file contains the temporary name, which does not help the user.
    let error =
        error.raw_os_error().map_or_else(|| error.kind().into(), std::io::Error::from_raw_os_error);
    let remedy = match error.kind() {
        std::io::ErrorKind::StorageFull => "make room, or name a file on another disk",
        _ => "name a file in a writable folder",
    };
    CliError::in_file(path, format!("{error}; {remedy}"))
}

/// Writes a text like [`write_whole`].
pub(super) fn write_text(path: &Path, text: &str) -> Result<(), CliError> {
    write_whole(path, |out| {
        out.write_all(text.as_bytes()).map_err(|error| write_error(path, &error))
    })
}

/// Writes the figure of measured and predicted torque.
pub(super) fn write_figure(
    path: &Path,
    cell: &Cell,
    identification: &Identification,
) -> Result<(), CliError> {
    let estimate = &identification.estimate;
    let heading =
        format!("{}: torque, measured and predicted by {}", estimate.robot, estimate.method);
    let svg =
        torque_figure(&heading, &joint_panels(identification, &cell.robot), &estimate.convergence);
    write_text(path, &svg)
}

/// Writes the report.
pub(super) fn write_report(path: &Path, report: &Report<'_>) -> Result<(), CliError> {
    write_text(path, &report.to_html())
}

/// Returns true if the value of `NO_COLOR` forbids colours (no-color.org).
pub(super) fn refuses_colour(no_color: Option<&OsStr>) -> bool {
    no_color.is_some_and(|value| !value.is_empty())
}

/// Returns a count with its noun: `1 window`, `2 windows`.
pub(super) fn count_with_noun(count: impl std::fmt::Display, noun: &str) -> String {
    let count = count.to_string();
    let ending = if count == "1" { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_no_plural() {
        let shown = [0_u64, 1, 2].map(|count| count_with_noun(count, "window"));
        assert_eq!(shown, ["0 windows", "1 window", "2 windows"]);
    }
}
