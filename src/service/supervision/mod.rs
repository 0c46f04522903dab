//! The complete service: bus thread, worker and status in one process, or in two.
//!
//! tokio runs the tasks that wait for people, signals and clocks. The bus and the worker have their
//! own threads. This module defines the reaction to a failure: a failed part ends the service, and
//! a service manager restarts it.

mod line;
mod manager;
mod readiness;
mod reload;
mod running;
mod sockets;
mod supervise;
mod threads;

use std::path::PathBuf;

use didim_drivers::assemble::Assembler;
use didim_drivers::source::Source;

use crate::live::acquire::{AcquireError, AcquireOptions, ReceiveBuffer};
use crate::live::recording::RecorderOptions;
use crate::live::stream::{StreamError, StreamOptions};
use crate::live::worker::{FindLoad, Identify, WorkerError, WorkerOptions};
use crate::service::status::{ListenError, Snapshot};

pub use reload::Reload;
pub use supervise::{run, run_with_reload};

/// A socket to listen at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SocketOptions {
    /// Path of the socket. The folder must exist.
    pub path: PathBuf,
    /// Permissions of the socket. Write access allows connections.
    pub mode: u32,
    /// Group of the socket. `None` keeps the service's group.
    pub group: Option<String>,
}

/// Options of the service in addition to its parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ServiceOptions {
    /// Status socket. 0o660 lets the group query it.
    pub status: Option<SocketOptions>,
    /// Command socket for windows. It needs an estimation. 0o600 unless a group may send commands.
    pub control: Option<SocketOptions>,
    /// Receive buffer granted by the kernel, for the status \[bytes\].
    pub receive_buffer: Option<ReceiveBuffer>,
}

/// Components of the bus thread.
pub struct AcquisitionPart {
    /// Source of the frames.
    pub source: Box<dyn Source>,
    /// Assembler that turns frames into samples.
    pub assembler: Assembler,
    /// The rest.
    pub options: AcquireOptions,
    /// Location of the recorded frames. With `None` none are recorded.
    pub recorder: Option<RecorderOptions>,
}

/// Components of the worker.
pub struct EstimationPart {
    /// Function that identifies a window.
    pub identify: Identify,
    /// Function that finds the load in a window. With `None` no load is searched for.
    pub find_load: Option<FindLoad>,
    /// The rest.
    pub options: WorkerOptions,
}

/// Parts that this process runs. Two processes with the same stream form one service.
pub enum Parts {
    /// Both.
    Both(Box<AcquisitionPart>, EstimationPart),
    /// The bus only: samples for a worker in another process.
    Acquisition(Box<AcquisitionPart>),
    /// The worker only.
    Estimation(EstimationPart),
}

impl Parts {
    fn stream(&self) -> &StreamOptions {
        match self {
            Self::Both(part, _) | Self::Acquisition(part) => &part.options.stream,
            Self::Estimation(part) => &part.options.stream,
        }
    }

    fn split(self) -> (Option<Box<AcquisitionPart>>, Option<EstimationPart>) {
        match self {
            Self::Both(acquisition, estimation) => (Some(acquisition), Some(estimation)),
            Self::Acquisition(acquisition) => (Some(acquisition), None),
            Self::Estimation(estimation) => (None, Some(estimation)),
        }
    }
}

/// Reason for the end of the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceEnd {
    /// SIGTERM or SIGINT, or SIGHUP if there is nothing to reload.
    Signal,
    /// The log, or the simulated arm, is at its end, and every window is processed.
    SourceEnded,
}

/// The reason for the end, and the last status before it.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceReport {
    /// Reason for its end.
    pub end: ServiceEnd,
    /// The counts at the end.
    pub snapshot: Snapshot,
}

/// Reason why the service could not start, or ended early.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The bus thread failed.
    #[error("acquisition: {0}")]
    Acquisition(#[from] AcquireError),
    /// The worker failed.
    #[error("estimation: {0}")]
    Estimation(#[from] WorkerError),
    /// The status cannot be published.
    #[error("status: {0}")]
    Stream(#[from] StreamError),
    /// A socket cannot be created.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system cannot provide a runtime, thread or signal handler.
    #[error("cannot {action}: {cause}")]
    System {
        /// The attempted operation.
        action: &'static str,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A thread panicked. Its message is in the log. Report it.
    #[error("the {thread} thread panicked: see the log above")]
    Panicked {
        /// Name of the thread.
        thread: &'static str,
    },
    /// A control socket is configured without an estimation to control.
    #[error("a control socket needs an estimation in the same process")]
    NothingToControl,
}
