//! Locations of the service's files.

use std::path::{Path, PathBuf};

use crate::cell::Cell;
use crate::files::{FolderError, own_folder, private_folder};
use crate::live::stream::{FOLDER_NAME, SERVICE_PREFIX, StreamError, StreamOptions};

/// File name of the status socket in the runtime folder.
const STATUS_SOCKET: &str = "status.sock";
/// File name of the status socket of an acquisition in a separate process.
const ACQUISITION_SOCKET: &str = "acquisition.sock";
/// File name of the command socket.
const COMMAND_SOCKET: &str = "command.sock";

/// File name of the socket of external torques.
const EXTERNAL_TORQUE_SOCKET: &str = "external_torque.sock";

/// The paths of one service or of a single run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Paths {
    /// Folder of the sockets and of the stream library's files.
    pub runtime: PathBuf,
    /// Folder of the results. If `None`, results are published but not stored.
    pub state: Option<PathBuf>,
    /// Prefix of the names in shared memory.
    pub prefix: String,
}

impl Paths {
    /// Returns the paths of the cell's service, with the beginning of its prefix. The service draws
    /// the rest.
    pub fn of_service(cell: &Cell) -> Self {
        Self {
            runtime: cell.service.runtime_directory.clone(),
            state: Some(cell.service.state_directory.clone()),
            prefix: SERVICE_PREFIX.to_owned(),
        }
    }

    /// Returns the paths of a service whose sockets are in `runtime`.
    pub fn with_sockets_in(runtime: &Path) -> Self {
        Self { runtime: runtime.to_path_buf(), state: None, prefix: SERVICE_PREFIX.to_owned() }
    }

    /// Creates the folders. Refuses folders that other users may change.
    ///
    /// # Errors
    /// [`FolderError`].
    pub fn create_folders(&self) -> Result<(), FolderError> {
        let folders = [Some(&self.runtime), self.state.as_ref()];
        folders.into_iter().flatten().try_for_each(|folder| own_folder(folder))?;
        private_folder(&self.stream_root())
    }

    /// Returns the path of the status socket.
    pub fn status_socket(&self) -> PathBuf {
        self.runtime.join(STATUS_SOCKET)
    }

    /// Returns the path of the status socket of an acquisition in a separate process.
    pub fn acquisition_socket(&self) -> PathBuf {
        self.runtime.join(ACQUISITION_SOCKET)
    }

    /// Returns the path of the command socket.
    pub fn command_socket(&self) -> PathBuf {
        self.runtime.join(COMMAND_SOCKET)
    }

    /// Returns the path of the socket of external torques.
    pub fn external_torque_socket(&self) -> PathBuf {
        self.runtime.join(EXTERNAL_TORQUE_SOCKET)
    }

    fn stream_root(&self) -> PathBuf {
        self.runtime.join(FOLDER_NAME)
    }

    pub(crate) fn stream_options(&self, cell: &Cell) -> Result<StreamOptions, StreamError> {
        StreamOptions::new(
            &cell.name,
            (&self.stream_root(), &self.prefix),
            cell.robot.joints(),
            cell.sample_rate_hz(),
            cell.service.buffer_s,
        )
    }
}
