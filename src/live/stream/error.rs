//! Errors of the stream between the bus thread and its readers.

use std::path::PathBuf;

/// Error when creating or using the stream.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// An option is outside its range. Change it in the cell file.
    #[error("{key}: {problem}")]
    Option {
        /// Key of the option.
        key: &'static str,
        /// The problem, and the allowed values.
        problem: String,
    },
    /// Shared memory is too small for the buffer. Free some memory, enlarge the tmpfs (`mount -o
    /// remount,size=…`), or reduce `buffer_s`.
    #[error(
        "the sample buffer needs {needed_bytes} bytes of shared memory and {} has \
         {available_bytes}: free some, enlarge it, or shorten buffer_s", folder.display()
    )]
    SharedMemoryFull {
        /// Folder of the tmpfs.
        folder: PathBuf,
        /// Memory that the next ports need \[bytes\].
        needed_bytes: u64,
        /// Available memory \[bytes\].
        available_bytes: u64,
    },
    /// The kernel could not provide the pages of the mapped shared memory. Most likely the tmpfs
    /// became full between the check and the mapping.
    #[error(
        "shared memory of {mapped_bytes} bytes is mapped, but {folder} cannot hold it ({cause}): \
         free some, enlarge it, or shorten buffer_s"
    )]
    Prefault {
        /// Folder of the tmpfs.
        folder: &'static str,
        /// Mapped memory \[bytes\].
        mapped_bytes: u64,
        /// The kernel's error.
        cause: std::io::Error,
    },
    /// The memory maps of the process or the free space of a file system cannot be read.
    #[error("cannot read {}: {cause}", path.display())]
    Inspect {
        /// The file that was read.
        path: PathBuf,
        /// The kernel's error.
        cause: std::io::Error,
    },
    /// A file with the network's prefix belongs to another user, or other users may open it. Stop
    /// all processes of the service, so that the next start draws another prefix.
    #[error(
        "{} of user {owner} {problem}; stop all processes of the service and start it again",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Owner of the file.
        owner: u32,
        /// Difference from a file of the network.
        problem: &'static str,
    },
    /// This process cannot join the network. Check that the user may write to the root folder.
    #[error(
        "cannot join the shared-memory network rooted at {}: {cause}; check the permissions of \
         that folder",
        root.display()
    )]
    Node {
        /// Root folder of the network.
        root: PathBuf,
        /// The library's error.
        cause: String,
    },
    /// A service with this name exists with other options or of another version. Stop the other
    /// process, or use the same cell file for both.
    #[error(
        "cannot open the service {name}: {cause}; use the same version and cell file for every \
         process of a cell, and check their limits of memory and open files"
    )]
    Service {
        /// Name of the service.
        name: String,
        /// The library's error.
        cause: String,
    },
    /// A port cannot be created, usually because the maximum number of ports exists: a cell has one
    /// acquisition. Stop the other process.
    #[error(
        "cannot make a {port} of {name}: {cause}; is another process doing this already, or are \
         memory or open files of this process limited?"
    )]
    Port {
        /// Kind of port: publisher, subscriber, notifier or listener.
        port: &'static str,
        /// Name of the service.
        name: String,
        /// The library's error.
        cause: String,
    },
    /// Sending, receiving or waiting failed in the library. Restart the process.
    #[error("{operation} on {name} failed: {cause}")]
    Transport {
        /// The attempted operation.
        operation: &'static str,
        /// Name of the service.
        name: &'static str,
        /// The library's error.
        cause: String,
    },
    /// The acquisition and the estimation were started with different cell files.
    #[error(
        "the samples are of {their_joints} joints at {their_rate_hz} Hz, this cell file says \
         {our_joints} at {our_rate_hz} Hz: start both processes with the same cell file"
    )]
    OtherCell {
        /// Number of joints of the received samples.
        their_joints: u32,
        /// Sample rate of the received samples \[Hz\].
        their_rate_hz: f64,
        /// Number of joints in the cell of this process.
        our_joints: u32,
        /// Sample rate in the cell of this process \[Hz\].
        our_rate_hz: f64,
    },
    /// A document is longer than the maximum.
    #[error("a document of {bytes} bytes does not fit: the limit is {limit} bytes")]
    DocumentTooLong {
        /// Length of the document \[bytes\].
        bytes: usize,
        /// Maximum length \[bytes\].
        limit: usize,
    },
}

impl StreamError {
    /// Creates the error for a failed operation of the library.
    pub(super) fn transport(
        operation: &'static str,
        name: &'static str,
        cause: impl core::fmt::Debug,
    ) -> Self {
        Self::Transport { operation, name, cause: format!("{cause:?}") }
    }

    /// Creates the error for a port that could not be created.
    pub(super) fn port(port: &'static str, name: &str, cause: impl core::fmt::Debug) -> Self {
        Self::Port { port, name: name.to_owned(), cause: format!("{cause:?}") }
    }

    /// Creates the error for a service that could not be opened.
    pub(super) fn service(name: &str, cause: impl core::fmt::Debug) -> Self {
        Self::Service { name: name.to_owned(), cause: format!("{cause:?}") }
    }
}
