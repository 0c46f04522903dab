//! Check that the folders of the service are writable and that memory and disk have enough space.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};
use rustix::process::geteuid;

use super::finding::Finding;
use super::machine::{Machine, space_left};
use super::method::window_bytes;
use crate::cell::Cell;
use crate::files::check_folder;
use crate::service::paths::Paths;

/// Size of one result with its line in the history \[bytes\]. Measured: 89 kB with six joints and
/// 28 parameters (docs/evidence/operations.md).
pub(super) const RESULT_BYTES: u64 = 100_000;
/// Longest path of a socket \[bytes\]: sun_path without its terminator.
const MAX_SOCKET_PATH: usize = 107;

const STATE_KEY: &str = "service.state_directory";
const RUNTIME_KEY: &str = "service.runtime_directory";

pub(super) fn check(cell: &Cell, machine: &Machine, findings: &mut Vec<Finding>) {
    check_writable(STATE_KEY, &cell.service.state_directory, findings);
    check_writable(RUNTIME_KEY, &cell.service.runtime_directory, findings);
    check_owner(STATE_KEY, &cell.service.state_directory, cell, findings);
    check_owner(RUNTIME_KEY, &cell.service.runtime_directory, cell, findings);
    check_sockets(cell, findings);
    check_disk(cell, findings);
    check_memory(cell, machine, findings);
}

/// Returns the folder, or its nearest existing parent.
pub(super) fn existing_parent(folder: &Path) -> PathBuf {
    folder.ancestors().find(|at| at.exists()).unwrap_or(Path::new("/")).to_owned()
}

fn check_writable(key: &str, folder: &Path, findings: &mut Vec<Finding>) {
    let nearest_folder = existing_parent(folder);
    if !nearest_folder.is_dir() {
        findings.push(Finding::error(
            key,
            format!("{} is not a folder", nearest_folder.display()),
            "name a folder",
        ));
    } else if access(&nearest_folder, Access::WRITE_OK | Access::EXEC_OK).is_err() {
        let problem = if nearest_folder == folder {
            format!("{} cannot be written by this user", folder.display())
        } else {
            format!(
                "{} is not there, and this user cannot make it in {}",
                folder.display(),
                nearest_folder.display()
            )
        };
        findings.push(Finding::warning(
            key,
            problem,
            "the systemd unit makes it for the service's user; otherwise make it, or name another \
             one",
        ));
    }
}

/// Returns the user id of the service. If root runs the check, it is that of the owner of the
/// results.
fn service_user(cell: &Cell) -> u32 {
    let user = geteuid();
    let state = std::fs::metadata(&cell.service.state_directory);
    match state {
        Ok(state) if user.is_root() => state.uid(),
        _ => user.as_raw(),
    }
}

/// Checks that an existing folder belongs to the service's user, and that only that user may write
/// to it.
pub(super) fn check_owner(key: &str, folder: &Path, cell: &Cell, findings: &mut Vec<Finding>) {
    if !folder.is_dir() {
        return;
    }
    if let Err(error) = check_folder(folder, service_user(cell)) {
        findings.push(Finding::error(
            key,
            error.to_string(),
            "correct it, or run this as the service's user: `runuser -u didim -- didim check …`",
        ));
    }
}

fn check_sockets(cell: &Cell, findings: &mut Vec<Finding>) {
    let paths = Paths::of_service(cell);
    let longest = [paths.status_socket(), paths.acquisition_socket(), paths.command_socket()]
        .into_iter()
        .max_by_key(|path| path.as_os_str().len());
    if let Some(path) = longest.filter(|path| path.as_os_str().len() > MAX_SOCKET_PATH) {
        findings.push(Finding::error(
            RUNTIME_KEY,
            format!("a socket's path has at most {MAX_SOCKET_PATH} bytes: {}", path.display()),
            "name a folder with a shorter path, such as /run/didim",
        ));
    }
}

fn check_disk(cell: &Cell, findings: &mut Vec<Finding>) {
    let nearest_folder = existing_parent(&cell.service.state_directory);
    let Some(free) = space_left(&nearest_folder) else { return };
    let needed = RESULT_BYTES.saturating_mul(cell.service.keep_results as u64);
    if free < needed {
        findings.push(Finding::warning(
            "service.keep_results",
            format!(
                "{} results take about {} MB, and {} has {} MB left",
                cell.service.keep_results,
                megabytes(needed),
                nearest_folder.display(),
                megabytes(free)
            ),
            "keep fewer results, or name a larger disk",
        ));
    }
}

fn check_memory(cell: &Cell, machine: &Machine, findings: &mut Vec<Finding>) {
    let paths = Paths::of_service(cell);
    // The reader of the cell has already refused values that do not fit the stream.
    let Ok(stream) = paths.stream_options(cell) else { return };
    let shared = stream.shared_memory_bytes();
    if let Some(free) = space_left(&machine.shared_memory).filter(|rest| *rest < shared) {
        findings.push(Finding::error(
            "service.buffer_s",
            format!(
                "the buffer takes {} MB of shared memory, and {} has {} MB left",
                megabytes(shared),
                machine.shared_memory.display(),
                megabytes(free)
            ),
            "shorten the buffer, or enlarge /dev/shm",
        ));
    }
    let windows = window_bytes(cell);
    let Some(available) = machine.memory_available() else { return };
    if windows + shared > available / 2 {
        findings.push(Finding::warning(
            "window.max_s",
            format!(
                "windows of {} s and the buffer take up to {} MB of the {} MB available",
                cell.window.max_s,
                megabytes(windows + shared),
                megabytes(available)
            ),
            "reduce `window.max_s` or `service.buffer_s`",
        ));
    }
}

pub(super) fn megabytes(bytes: u64) -> u64 {
    bytes.div_ceil(1_000_000)
}
