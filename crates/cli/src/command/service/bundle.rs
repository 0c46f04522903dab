//! `didim bundle`: packs what a service saw, for somebody who cannot see the machine.

use std::cell::RefCell;
use std::fs::{self, File, Permissions};
use std::io::{Read as _, Seek as _, SeekFrom};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::CliError;
use crate::bundle::{Bundle, ENDING, JOURNAL, MAX_BYTES, RECORDING};
use crate::names::DEFAULT_CELL;
use crate::output::{check_outputs, print, write_error, write_whole};
use crate::state::check_is_folder;
use crate::stream::InputFileOrStream;
use didim::archive::events::EventSource;
use didim::archive::store::{history_parts, result_file};
use didim::cell::{Cell, Library, ServiceSection};
use didim::live::recording::is_mcap;
use didim::service::paths::Paths;
use didim::service::status::fetch_snapshot;

/// Maximum size of a text in a bundle \[bytes\]. The end of a longer one is packed.
const MAX_TEXT: u64 = 4 << 20;
/// Maximum size of a part of the history \[bytes\]. Ten years of 3,000 results a day have 55 MB.
const MAX_HISTORY: u64 = 64 << 20;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The bundle to write: *.tar.zst
    out: PathBuf,
    /// The cell file of the service
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The folder of its results [default: the cell's]
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// The folder of its sockets [default: the cell's]
    #[arg(long, value_name = "FOLDER")]
    runtime: Option<PathBuf>,
    /// The number of the result to pack [default: the last one]
    #[arg(long, value_name = "N")]
    result: Option<u64>,
    /// A kept recording to pack, at most 256 MB with all other parts
    #[arg(long, value_name = "FILE")]
    recording: Option<PathBuf>,
    /// The journal, whose last lines that name didim are packed; - reads it from a pipe:
    /// `journalctl --unit 'didim*' | didim bundle OUT --journal -`
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { out, cell: cell_file, recording, .. } = arguments;
    if !out.as_os_str().as_encoded_bytes().ends_with(ENDING.as_bytes()) {
        let why = format!("{}: the name of a bundle ends with {ENDING}", out.display());
        return Err(CliError::Usage(why));
    }
    if let Some(state) = &arguments.state {
        check_is_folder(state)?;
    }
    let read: Vec<&Path> = [cell_file].into_iter().chain(recording).map(PathBuf::as_path).collect();
    check_outputs([out], &read)?;
    let mut bundle = Bundle::default();
    bundle.contents.version = env!("CARGO_PKG_VERSION").to_owned();
    bundle.contents.kernel = of_kernel("osrelease");
    bundle.contents.processor = std::env::consts::ARCH.to_owned();

    let cell_file =
        fs::canonicalize(cell_file).map_err(|cause| CliError::in_file(cell_file, cause))?;
    let files = RefCell::default();
    let service = match Cell::from_library(Library::Recording(&files), &cell_file) {
        Ok(cell) => cell.service,
        Err(error) => {
            // Further lines quote the file.
            let why = error.to_string().lines().next().unwrap_or_default().to_owned();
            bundle.contents.left_out.push(("cell".to_owned(), why));
            ServiceSection::default()
        }
    };
    bundle.contents.cell = cell_file;
    let (named, others): (Vec<_>, Vec<_>) = files
        .into_inner()
        .into_iter()
        .partition(|(path, _)| *path == bundle.contents.cell || is_of_cell(path));
    bundle.add_configuration(named);
    for (path, _) in others {
        let why = format!("its name ends with none of {}", ENDINGS.join(", "));
        bundle.contents.left_out.push((path.display().to_string(), why));
    }
    add_service(&mut bundle, arguments, &service)?;
    if let Some(path) = recording {
        let in_file = |cause| CliError::in_file(path, cause);
        let data = fs::metadata(path).map_err(in_file)?;
        if !data.is_file() {
            return Err(CliError::in_file(path, "no file; name an MCAP recording that was kept"));
        }
        if data.len() > MAX_BYTES {
            let why = format!("it has more than {} MB; pack a shorter one", MAX_BYTES >> 20);
            return Err(CliError::in_file(path, why));
        }
        if !is_mcap(path) {
            return Err(CliError::in_file(path, "no MCAP recording; name one that was kept"));
        }
        bundle.add(RECORDING, fs::read(path).map_err(in_file)?);
    }
    bundle.remove_secrets(&of_kernel("hostname"));
    let left_out = bundle.contents.left_out.clone();
    let packed = bundle.pack()?;
    write_whole(out, |file| file.write_all(&packed).map_err(|error| write_error(out, &error)))?;
    // As little as the folder of the results, it is for everybody of this machine. A medium without
    // permissions has none to set.
    if let Err(problem) = fs::set_permissions(out, Permissions::from_mode(0o600)) {
        tracing::warn!("{}: others may read it: {problem}", out.display());
    }
    let mut text = format!("{}: {} kB\n", out.display(), packed.len().div_ceil(1000));
    for (part, why) in left_out {
        text += &format!("without {part}: {why}\n");
    }
    print(&text)
}

/// Adds status, journal, events, history, baseline and a result.
fn add_service(
    bundle: &mut Bundle,
    arguments: &Arguments,
    service: &ServiceSection,
) -> Result<(), CliError> {
    let runtime = arguments.runtime.as_ref().unwrap_or(&service.runtime_directory);
    let state = arguments.state.as_ref().unwrap_or(&service.state_directory);
    let status = fetch_snapshot(&Paths::with_sockets_in(runtime));
    let status = status.map_err(|error| error.to_string());
    let json = status
        .and_then(|status| serde_json::to_vec_pretty(&status).map_err(|error| error.to_string()));
    bundle.add_or_explain("status.json", json);
    if let Some(path) = &arguments.journal {
        let input = InputFileOrStream::open(path)?;
        let text = read_end(input.path(), MAX_TEXT);
        let text = text.map_err(|cause| CliError::in_file(path, cause))?;
        bundle.add(JOURNAL, own_lines(&text).into_bytes());
    }
    let result = match arguments.result {
        Some(number) => {
            let path = result_file(state, number);
            fs::metadata(&path).map_err(|cause| CliError::in_file(&path, cause))?;
            path
        }
        None => state.join("latest.json"),
    };
    let parts = [
        ("events.jsonl", EventSource::Service.file_in(state)),
        ("events-acquisition.jsonl", EventSource::Acquisition.file_in(state)),
        ("baseline.json", state.join("baseline.json")),
        ("result.json", result),
    ];
    for (name, path) in parts {
        add_end(bundle, name, &path, MAX_TEXT);
    }
    add_end(bundle, "history.jsonl", &state.join("history.jsonl"), MAX_HISTORY);
    let parts = history_parts(state).unwrap_or_else(|error| {
        bundle.contents.left_out.push(("earlier history".to_owned(), error.to_string()));
        Vec::new()
    });
    for path in parts {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        add_end(bundle, &name, &path, MAX_HISTORY);
    }
    Ok(())
}

/// Adds a file, or its end if it is longer than `limit`.
fn add_end(bundle: &mut Bundle, name: &str, path: &Path, limit: u64) {
    if fs::metadata(path).is_ok_and(|file| file.len() > limit) {
        let part = format!("the beginning of {name}");
        bundle.contents.left_out.push((part, format!("it has more than {} MB", limit >> 20)));
    }
    let read = read_end(path, limit).map_err(|error| format!("{}: {error}", path.display()));
    bundle.add_or_explain(name, read);
}

/// Reads a file. If it is longer than `limit`, only its end, from the beginning of a line.
fn read_end(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let surplus = file.metadata()?.len().saturating_sub(limit);
    file.seek(SeekFrom::Start(surplus))?;
    let mut content = Vec::new();
    file.take(limit).read_to_end(&mut content)?;
    if surplus > 0 {
        let line = content.iter().position(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        content.drain(..line);
    }
    Ok(content)
}

/// Endings of the files that a cell names.
const ENDINGS: [&str; 8] = ["toml", "dbc", "eds", "dcf", "xml", "urdf", "csv", "pcapng"];

/// Returns true for a file that a cell may name. A wrong one may name any file.
fn is_of_cell(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    ENDINGS.contains(&ending.as_str())
}

/// Returns the lines that this program, or one of its parts, has written to a journal. The name of
/// the program stands before the number of the process, `didim[2]: `.
fn own_lines(journal: &[u8]) -> String {
    let text = String::from_utf8_lossy(journal);
    let (mut own, mut is_in_own) = (String::new(), false);
    for line in text.lines() {
        // A message of several lines goes on with a blank.
        is_in_own = if line.starts_with(' ') { is_in_own } else { is_own(line) };
        if is_in_own {
            own += line;
            own.push('\n');
        }
    }
    own
}

/// Returns true for a line of this program, and for one of the service manager about it.
fn is_own(line: &str) -> bool {
    let Some((head, message)) = line.split_once(": ") else { return false };
    let program = head.rsplit(' ').next().unwrap_or_default();
    let program = program.split('[').next().unwrap_or_default();
    let is_of_program = |name: &str| name == "didim" || name.starts_with("didim-");
    let unit = message.split(['.', '@']).next().unwrap_or_default();
    is_of_program(program) || (program == "systemd" && is_of_program(unit))
}

/// Returns an entry of /proc/sys/kernel; empty if it cannot be read.
fn of_kernel(entry: &str) -> String {
    let text = fs::read_to_string(Path::new("/proc/sys/kernel").join(entry)).unwrap_or_default();
    text.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_journal_has_the_lines_of_this_program() {
        let journal = b"Nov 28 arm-7 sshd[1]: password of root\n\
            Nov 28 arm-7 sudo[4]: me : COMMAND=/usr/bin/didim status\n  of root\n\
            Nov 28 arm-7 systemd[1]: didim@left.service: Failed with result 'oom-kill'.\n\
            Nov 28 arm-7 systemd[1]: other.service: Failed.\n\
            2026-11-28T10:00:00+0100 arm-7 didim[2]: starts: now\n  and here\n\
            Nov 28 arm-7 didim-publish[3]: sent\n";
        assert_eq!(
            own_lines(journal),
            "Nov 28 arm-7 systemd[1]: didim@left.service: Failed with result 'oom-kill'.\n\
             2026-11-28T10:00:00+0100 arm-7 didim[2]: starts: now\n  and here\n\
             Nov 28 arm-7 didim-publish[3]: sent\n"
        );
    }

    #[test]
    fn of_a_long_file_the_end_is_read_from_a_line_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history.jsonl");
        fs::write(&path, "first\nsecond\nthird\n").unwrap();
        assert_eq!(read_end(&path, 9).unwrap(), b"third\n");
        assert_eq!(read_end(&path, 100).unwrap(), b"first\nsecond\nthird\n");
    }
}
